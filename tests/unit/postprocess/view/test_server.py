"""The page's server: who gets in, what it listens on, how it ends."""

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
import pytest
from synthetic import SyntheticRun, write_run
from synthetic.viewing import serving

from smarticles.main import main

ADDRESS = re.compile(r"http://127\.0\.0\.1:(\d+)/index\.html\?token=([\w-]{43})")


@pytest.fixture(scope="module")
def pile(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("runs") / "pile", SyntheticRun(frames_per_phase=1))


@pytest.fixture(scope="module")
def page(pile):
    with serving(pile) as (process, address):
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


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_it_well(pile, number):
    with serving(pile) as (process, address):
        assert ADDRESS.fullmatch(address)
        process.send_signal(number)
        _, said = process.communicate(timeout=30)
        assert process.returncode == 0
        assert said == "close its window, or press Ctrl-C, to end\n"


def test_a_port_that_is_taken_is_one_line(pile, capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["view", str(pile), "--no-browser", "--port", str(port)]) == 2
    assert capsys.readouterr().err == (
        f"smarticles: error: --port {port}: cannot listen there (Address already in use); leave it out, or choose "
        "another\n"
    )


def test_what_is_no_run_is_refused(tmp_path, capsys):
    assert main(["view", str(tmp_path)]) == 2
    assert "cannot read run directory" in capsys.readouterr().err
