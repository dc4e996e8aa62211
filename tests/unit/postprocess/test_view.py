"""The page of a run: what it shows, access by token, what its server listens on, how it ends."""

import asyncio
import http.cookiejar
import os
import re
import signal
import socket
import urllib.error
import urllib.request

import aiohttp
import msgpack
import numpy as np
import pytest
from synthetic import T1, SyntheticRun, W, u_shape, write_frame, write_run
from synthetic.viewing import serving

from dem.errors import InputError
from postprocess.view import RunView
from smarticles.main import main


@pytest.fixture
def pile(tmp_path):
    return write_run(tmp_path / "pile", SyntheticRun(frames_per_phase=2, floor_z=-0.003))


@pytest.fixture
def two(tmp_path):
    """Two flat smarticles one above the other, 20 mm apart, over a floor at -3 mm."""
    directory = tmp_path / "two"
    write_run(directory, SyntheticRun(count=2, frames_per_phase=1, phases=("relax",), packing=(0.001,)))
    vertices = u_shape(0.7 * W) + np.array([[[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.02]]])
    write_frame(directory / "frames/frame_000000.vtu", vertices, time=0.5, phase=0, floor_z=-0.003)
    return directory


def test_a_ray_picks_the_smarticle_that_it_meets_first(two):
    view = RunView(two)
    view.draw()
    y = 1e3 * u_shape(0.7 * W)[1, 1]  # of the middle links, in mm; heights in the page are above the floor
    view.pick_along(np.array([[0.0, y, 100.0], [0.0, y, -100.0]]))
    assert (view.pick.smarticle_id, view.pick.link) == (1, 1)
    view.pick_along(np.array([[0.0, y, 10.0], [0.0, y, -100.0]]))
    assert (view.pick.smarticle_id, view.pick.link) == (0, 1)
    barb = 1e3 * u_shape(0.7 * W)[0]
    view.pick_along(np.array([[barb[0], barb[1] - 1.0, 100.0], [barb[0], barb[1] - 1.0, -100.0]]))
    assert (view.pick.smarticle_id, view.pick.link) == (1, 0)
    view.pick_along(np.array([[50.0, 50.0, 100.0], [50.0, 50.0, -100.0]]))
    assert view.pick is None


def test_bodies_stand_on_the_floor_in_millimetres(two):
    view = RunView(two)
    view.draw()
    bounds = view._meshes["smarticles"].bounds
    assert bounds[4:] == pytest.approx((3.0 - 1e3 * T1 / 2, 23.0 + 1e3 * T1 / 2), abs=1e-3)
    assert view._meshes["floor"].bounds[4] == pytest.approx(0.0, abs=1e-6)


def test_a_damaged_frame_leaves_what_is_shown(pile):
    view = RunView(pile)
    os.truncate(pile / "frames/frame_000002.vtu", 300)
    with pytest.raises(InputError, match=r"frame_000002\.vtu: truncated"):
        view.go_to(2)
    assert view.index == 7
    view.colour_by("speed")
    view.draw()


ADDRESS = re.compile(r"http://127\.0\.0\.1:(\d+)/index\.html\?token=([\w-]{43})")


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("runs") / "pile", SyntheticRun(frames_per_phase=1))


@pytest.fixture(scope="module")
def page(served):
    with serving(served) as (process, address):
        yield process, address


def asked(url, *, cookies=None, method="GET"):
    """Status, headers and text of an answer."""
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(cookies))
    try:
        with opener.open(urllib.request.Request(url, method=method), timeout=10) as answer:
            return answer.status, answer.headers, answer.read().decode("utf-8", "replace")
    except urllib.error.HTTPError as error:
        return error.code, error.headers, error.read().decode()


@pytest.mark.parametrize("path", ["", "index.html", "vue.global.js", "logo.png", "ws", "__trame_vtk/trame-vtk.js"])
@pytest.mark.parametrize("token", [None, "", "wrong"])
def test_nothing_is_given_without_the_token(page, path, token):
    base = page[1].partition("index.html")[0]
    status, headers, text = asked(base + path + ("" if token is None else f"?token={token}"))
    assert status == 403
    assert "Set-Cookie" not in headers
    assert "with its token" in text
    assert ADDRESS.fullmatch(page[1])[2] not in text


def test_messages_need_it_too(page):
    base, _, _ = page[1].partition("index.html")
    assert asked(base + "paraview/", method="POST")[0] == 403
    token = ADDRESS.fullmatch(page[1])[2]

    async def greeted(secret):
        async with (
            aiohttp.ClientSession(cookies={f"smarticles-{ADDRESS.fullmatch(page[1])[1]}": token}) as session,
            session.ws_connect(base.replace("http", "ws") + "ws") as socket_,
        ):
            hello = {"wslink": "1.0", "id": "system:c0:0", "method": "wslink.hello", "args": [{"secret": secret}]}
            body = msgpack.packb(hello)
            head = os.urandom(4) + (0).to_bytes(4, "little") + len(body).to_bytes(4, "little")
            await socket_.send_bytes(head + body)
            answer = await socket_.receive_bytes(timeout=10)
            return msgpack.unpackb(answer[12:])

    assert "result" in asyncio.run(greeted(token))
    assert "error" in asyncio.run(greeted("wslink-secret"))


def test_the_token_opens_the_page_and_then_a_cookie_does(page):
    jar = http.cookiejar.CookieJar()
    status, headers, text = asked(page[1], cookies=jar)
    assert status == 200
    assert '<div id="app">' in text
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert headers["Referrer-Policy"] == "no-referrer"
    assert "connect-src 'self' ws://127.0.0.1:" in headers["Content-Security-Policy"]
    assert asked(page[1].partition("index.html")[0] + "vue.global.js", cookies=jar)[0] == 200


def test_host_and_port_are_those_of_the_server_whatever_the_browser_says(page):
    port, token = ADDRESS.fullmatch(page[1]).groups()
    for path, method in ((f"index.html?token={token}", "GET"), (f"paraview/?token={token}", "POST")):
        request = urllib.request.Request(f"http://127.0.0.1:{port}/{path}", method=method, headers={"Host": "evil:66"})
        with urllib.request.urlopen(request, timeout=10) as answer:
            said = f"{answer.headers}{answer.read().decode()}"
        assert f"ws://127.0.0.1:{port}" in said
        assert f"smarticles-{port}=" in said
        assert ":66" not in said
        assert "smarticles-66" not in said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_it_well(served, number):
    with serving(served) as (process, address):
        assert ADDRESS.fullmatch(address)
        process.send_signal(number)
        _, said = process.communicate(timeout=30)
        assert process.returncode == 0
        assert said == "close the page or press Ctrl-C to end\n"


def test_a_port_that_is_taken_is_one_line(served, capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["view", str(served), "--no-browser", "--port", str(port)]) == 2
    assert capsys.readouterr().err == (
        f"smarticles: error: --port {port}: cannot listen there (Address already in use); leave it out, or choose "
        "another\n"
    )
