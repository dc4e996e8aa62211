"""Show a run in the browser, in an interactive page that a server on this machine serves."""

import asyncio
import contextlib
import os
import secrets
import signal
import threading
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyvista as pv
from aiohttp import web
from trame.app import get_server
from trame.ui.html import DivLayout
from trame.widgets import client, html
from trame.widgets import vtk as vtk_widgets
from vtkmodules.vtkCommonCore import vtkLogger

from dem.errors import InputError
from dem.record.frames import read_frames
from dem.record.run import open_run
from postprocess.bodies.colours import ColourScale, colour_field, scalars, span
from postprocess.bodies.fields import IDENTITY, fields_of, link_values
from postprocess.bodies.meshes import USUAL, Bodies
from postprocess.geometry.links import Floats
from postprocess.pictures.canvas import VIEWS, add_bodies, axes_from, visible_meshes

HOST = "127.0.0.1"  #: Loopback interface, unreachable from other machines
PICKED = (255, 0, 170)  #: Colour of the selected smarticle, which no colour scale has

_SAMPLES, _COSTLY_SAMPLES = 12, 3  # number of frames that define a colour scale
# 'unsafe-eval' because the page's script compiles its templates; it may connect to this server alone.
_HEADERS = {
    "Content-Security-Policy": "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; connect-src 'self' {own} "
    "data: blob:; frame-ancestors 'none'; base-uri 'self'; form-action 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
_FRAMES_EVERY = 1.0  # time between searches for new frames [s]
_FILM_STEP = 0.12  # time between two frames while the film plays [s]
_CLOSED_FOR = 5  # time without a page until the server ends, longer than reloading a page takes [s]

_STYLE = """
html, body { margin: 0; height: 100%; font: 14px system-ui, sans-serif; color: #1a1a1a; background: #fff; }
.page { display: grid; grid-template: auto 1fr auto / 1fr auto; height: 100vh; }
.page header, .page footer { grid-column: 1 / 3; padding: 8px 12px; display: flex; flex-wrap: wrap; gap: 6px 16px;
  align-items: center; background: #f4f4f2; }
.page header b { overflow-wrap: anywhere; }
.page main { position: relative; min-width: 0; min-height: 0; }
.page aside { width: 250px; padding: 10px 12px; overflow: auto; background: #fafaf8; }
.page input[type=range] { flex: 1; min-width: 120px; }
.page dl { margin: 0; } .page dt { font-size: 12px; color: #55595e; margin-top: 6px; }
.page dd { margin: 0; font-variant-numeric: tabular-nums; overflow-wrap: anywhere; }
.key { display: flex; align-items: center; gap: 8px; }
.key i { width: 18px; height: 16px; display: inline-block; }
.fault { color: #b3261e; }
@media (max-width: 640px) { .page { grid-template: auto 1fr auto auto / 1fr; }
  .page header, .page footer { grid-column: 1; } .page aside { width: auto; max-height: 30vh; } }
"""


class Pick(NamedTuple):
    """The selected smarticle and its selected link, 0 to 2."""

    smarticle_id: int
    link: int


class RunView:
    """State of the page of a run: shown frame, coloured field, and selected smarticle."""

    def __init__(self, directory: Path | str) -> None:
        self.run = open_run(directory)
        self.frames = read_frames(directory)
        self.index = len(self.frames) - 1
        self.frame = self.frames[-1]
        self.fields = tuple(
            field
            for field in fields_of(self.run)
            if not field.on_request and (field.costly or field.take(self.frame, self.run) is not None)
        )
        self.field = colour_field(None, self.run)
        self.pick: Pick | None = None
        window: Any = pv.Plotter(off_screen=True)
        window.set_background("white")
        self.plotter = window
        self._bodies = Bodies(self.run, USUAL, [each for each in self.fields if each.name in IDENTITY])
        self._meshes: dict[str, pv.PolyData] = {}
        self._bodies.hold(self.frames[index] for index in self._sampled(_SAMPLES))
        self._bounds: dict[str, tuple[float, float]] = {}

    @property
    def phase(self) -> str:
        """Type of the phase to which the shown frame belongs."""
        phases = self.run.phases
        return phases[self.frame.phase].type if self.frame.phase < len(phases) else "?"

    @property
    def ended(self) -> bool:
        """Whether the run directory will get no more frames; true if it does not exist any more."""
        try:
            return open_run(self.run.path).status.state not in ("running", "stopped")
        except InputError:
            return True

    def grow(self) -> bool:
        """Search for new frames, and return whether there are any."""
        before, self.frames = len(self.frames), read_frames(self.run.path)
        return len(self.frames) > before

    def go_to(self, index: int) -> None:
        """Show the frame with an index; if its file is damaged, raise InputError and keep the shown frame."""
        index = min(max(index, 0), len(self.frames) - 1)
        frame = self.frames[index]
        self._bodies.hold([frame])
        self.index, self.frame = index, frame

    def colour_by(self, name: str) -> None:
        """Colour smarticles by the field with a name."""
        self.field = colour_field(name, self.run)

    def draw(self) -> None:
        """Draw the bodies of the shown frame."""
        values = scalars(self.field, self.frame, self.run)
        colours = ColourScale.of(self.field, self._widened(values), [self.run]).painted(values)
        if self.pick is not None:
            colours[self.frame.smarticle_ids == self.pick.smarticle_id] = PICKED
        self._meshes = visible_meshes(self._bodies, self.frame, np.zeros(3))
        add_bodies(self.plotter, self._meshes, self.frame, colours)

    def aim(self) -> None:
        """Point the camera at all bodies from the front, slightly from above; at a planar run from above."""
        _, up, forward = axes_from(*VIEWS["top" if self.run.manifest.planar else "front"])
        camera = self.plotter.camera
        camera.focal_point, camera.position, camera.up = (0.0, 0.0, 0.0), tuple(-forward), tuple(up)
        self.plotter.reset_camera(render=False)

    def legend(self) -> list[dict[str, str]]:
        """Return colours and labels of the legend: names in order, other values from the greatest one."""
        scale = ColourScale.of(self.field, self._bounds.get(self.field.name, (0.0, 1.0)), [self.run])
        colours = scale.painted(np.array(list(scale.labels))).tolist()
        pairs = list(zip(colours, scale.labels.values(), strict=True))[:: 1 if scale.kind == "name" else -1]
        return [{"colour": "#{:02x}{:02x}{:02x}".format(*colour), "label": label} for colour, label in pairs]

    def pick_along(self, ray: Floats) -> None:
        """Select the first smarticle on a ray given by two points (2, 3) [mm], or none."""
        self.pick = None
        if "smarticles" in self._meshes:
            mesh = self._meshes["smarticles"]
            triangles = mesh.triangulate()
            _, faces = triangles.ray_trace(ray[0], ray[1], first_point=True)
            if np.size(faces):
                face = int(np.atleast_1d(faces)[0])
                self.pick = Pick(*(int(triangles.cell_data[name][face]) for name in IDENTITY))

    def describe(self) -> list[dict[str, str]]:
        """Return name, unit, value and meaning of all fields of the selected link, as text."""
        if self.pick is None:
            return []
        (found,) = np.nonzero(self.frame.smarticle_ids == self.pick.smarticle_id)
        if not len(found):
            return []
        rows = []
        for field in self.fields:
            values = link_values(field, self.frame, self.run)
            if values is not None:
                value = _text(values[int(found[0]), self.pick.link])
                rows.append({"name": field.name, "unit": field.unit, "value": value, "meaning": field.meaning})
        return rows

    def _sampled(self, number: int) -> list[int]:
        return sorted({round(place) for place in np.linspace(0, len(self.frames) - 1, number)})

    def _widened(self, values: Floats) -> tuple[float, float]:
        """Return the least and the greatest value of the coloured field, the ends of its colour scale.

        They are the extremes of `values`, of all frames shown before, and of some frames evenly spaced over the run.
        """
        name = self.field.name
        samples = [np.array(self._bounds.get(name, ())), values]
        if name not in self._bounds:
            for index in self._sampled(_COSTLY_SAMPLES if self.field.costly else _SAMPLES):
                with contextlib.suppress(InputError):  # reported when this frame is shown
                    samples.append(scalars(self.field, self.frames[index], self.run))
        self._bounds[name] = span(samples)
        return self._bounds[name]


def _text(value: Any) -> str:
    if np.ndim(value):
        return "(" + ", ".join(f"{part:.4g}" for part in value) + ")"
    return str(int(value)) if isinstance(value, np.integer) else f"{value:.4g}"


class Viewer:
    """The page of a run, and its server; `opened` is called with the address once the server listens."""

    def __init__(self, view: RunView, *, port: int, opened: Callable[[str], None]) -> None:
        self._view = view
        self._port = port
        self._token = secrets.token_urlsafe(32)
        self._web: Any = None
        self._server: Any = get_server(f"smarticles-{id(self)}", client_type="vue3")
        self._stopping: asyncio.Future[None] | None = None
        state = self._state = self._server.state
        # Texts of the run are values of variables, so that none can become code of the page.
        state.trame__title = "smarticles"
        state.run_name = view.run.manifest.name
        state.fields = [
            {"name": each.name, "title": each.name if each.unit == "-" else f"{each.name} [{each.unit}]"}
            for each in view.fields
        ]
        state.field = view.field.name
        state.index, state.last = view.index, len(view.frames) - 1
        state.playing, state.following = False, not view.ended
        state.fault = ""
        self._describe()
        view.aim()
        state.change("index")(self._on_index)
        state.change("field")(self._on_field)
        state.change("playing")(self._on_playing)
        controller = self._server.controller
        controller.add("on_server_bind")(self._bind)
        controller.add("on_server_ready")(
            lambda **_: opened(f"http://{HOST}:{self._server.port}/index.html?token={self._token}")
        )
        controller.add("on_client_connected")(self._shorten)
        self._lay_out()

    def serve(self) -> None:
        """Serve the page until it is closed; InputError if the port is taken."""
        # Otherwise trame would read the arguments of this process.
        os.environ["TRAME_ARGS"] = f"--server --host {HOST} --authKey={self._token} --nosignalhandlers"
        os.environ["WSLINK_READY_MSG"] = ""
        try:
            asyncio.run(self._run())
        except OSError as error:
            cause = os.strerror(error.errno or 0)
            msg = f"--port {self._port}: cannot listen there ({cause}); leave it out, or choose another"
            raise InputError(msg) from None

    async def _run(self) -> None:
        loop = asyncio.get_running_loop()
        # A signal that interrupts VTK would crash the process; a handler of the event loop runs between calls.
        for number in (signal.SIGINT, signal.SIGTERM):
            if threading.current_thread() is threading.main_thread():
                loop.add_signal_handler(number, self._stop)
        watch = asyncio.create_task(self._watch())
        try:
            await self._server.start(
                exec_mode="coroutine", port=self._port, host=HOST, timeout=0, show_connection_info=False,
                open_browser=False, disable_logging=True,
            )  # fmt: skip
        finally:
            watch.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await watch

    def _stop(self) -> None:
        if self._stopping is None and self._web is not None:
            self._stopping = asyncio.ensure_future(self._server.stop())

    def _bind(self, served: Any) -> None:
        self._web = served
        protect(served.app, self._token)

    def _shorten(self, **_: Any) -> None:
        self._web.config["timeout"] = _CLOSED_FOR

    def _lay_out(self) -> None:
        with DivLayout(self._server, classes="page"):
            client.Style(_STYLE)
            with html.Header():
                html.B("{{ run_name }}")
                html.Span("{{ caption }}")
                with html.Label("colour by "), html.Select(v_model=("field",), id="field"):
                    html.Option("{{ entry.title }}", v_for="entry in fields", key="entry.name", value=("entry.name",))
                html.Span("{{ fault }}", v_if="fault", classes="fault", role="alert")
            with html.Main():
                self._canvas = vtk_widgets.VtkLocalView(
                    self._view.plotter.render_window, picking_modes=("['click']",), click=(self._on_click, "[$event]")
                )
            with html.Aside():
                with html.Div(v_for="(entry, k) in legend", key="k", classes="key"):
                    html.I(style=("{ background: entry.colour }",))
                    html.Span("{{ entry.label }}")
                html.P("click on a smarticle to see its fields", v_if="!picked.length")
                with html.Dl(v_if="picked.length", id="pick"), html.Template(v_for="entry in picked", key="entry.name"):
                    html.Dt("{{ entry.name }}", title=("entry.meaning",))
                    html.Dd("{{ entry.value }} {{ entry.unit == '-' ? '' : entry.unit }}")
            with html.Footer():
                html.Button("{{ playing ? 'stop' : 'play' }}", click="playing = !playing", id="play")
                html.Input(
                    type="range", min=0, max=("last",), step=1, v_model_number=("index",), id="time",
                    aria_label="frame",
                )  # fmt: skip
                html.Span("{{ clock }}", id="clock")
                with html.Label(v_if="growing"):
                    html.Input(type="checkbox", v_model=("following",), id="follow")
                    html.Span(" follow the run")

    def _describe(self) -> None:
        """Draw the shown frame, and update the texts of the page."""
        view, state = self._view, self._state
        view.draw()
        state.caption = f"N = {view.frame.count} of {view.run.manifest.count}, {view.phase}"
        state.clock = f"t = {view.frame.time:.4g} s, frame {view.index} of {len(view.frames) - 1}"
        state.legend = view.legend()
        state.picked = view.describe()
        state.growing = not view.ended

    def _redraw(self) -> None:
        self._describe()
        self._canvas.update()

    def _on_index(self, index: Any, **_: Any) -> None:
        if int(index) == self._view.index:
            return
        try:
            self._view.go_to(int(index))
            self._state.fault = ""
        except InputError as error:
            self._state.fault = str(error)
            return
        self._redraw()

    def _on_field(self, field: str, **_: Any) -> None:
        if field != self._view.field.name:
            self._view.colour_by(field)
            self._redraw()

    def _on_click(self, event: Any) -> None:
        ray = np.asarray((event or {}).get("ray", ()), dtype=np.float64)
        if ray.shape == (2, 3) and np.isfinite(ray).all():
            self._view.pick_along(ray)
        else:
            self._view.pick = None
        self._redraw()

    def _on_playing(self, playing: bool, **_: Any) -> None:
        if playing:
            asyncio.create_task(self._play())  # noqa: RUF006 - it ends by itself

    async def _play(self) -> None:
        while self._state.playing:
            with self._state as state:
                state.index = (self._view.index + 1) % len(self._view.frames)
            await asyncio.sleep(_FILM_STEP)

    async def _watch(self) -> None:
        """Search for new frames at intervals, and show the last one if the page follows the run."""
        while True:
            await asyncio.sleep(_FRAMES_EVERY)
            try:
                grown = self._view.grow()
            except InputError:  # the run directory is being rewritten, or was deleted
                continue
            with self._state as state:
                state.growing = not self._view.ended
                if grown:
                    state.last = len(self._view.frames) - 1
                    if state.following:
                        state.index = state.last


def view_run(directory: Path | str, *, port: int = 0, opened: Callable[[str], None]) -> None:
    """Serve the page of a run to browsers on this machine, until the page is closed.

    The run may be unfinished. `opened` is called with the address of the page once the server listens on the port. The
    port 0 stands for any free port. InputError if there is no frame, a file is damaged, or the port is taken.
    """
    # The page needs no display, of whose absence VTK would warn.
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    Viewer(RunView(directory), port=port, opened=opened).serve()


def _port(request: web.Request) -> int:
    """Return the port of a request's connection; the port in `request.url` is what the browser claims."""
    assert request.transport is not None
    return int(request.transport.get_extra_info("sockname")[1])


def protect(app: web.Application, token: str) -> None:
    """Reject every request without the token by status 403.

    The first request has the token in its address; later ones have it in a cookie, which other sites cannot use.
    """

    @web.middleware
    async def guard(
        request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
    ) -> web.StreamResponse:
        # Servers on several ports share the cookies of a machine.
        name = f"smarticles-{_port(request)}"
        tokens = request.query.get("token", ""), request.cookies.get(name, "")
        allowed = [secrets.compare_digest(word.encode(), token.encode()) for word in tokens]
        if not any(allowed):
            raise web.HTTPForbidden(text="403: open the address that `smarticles view` printed, with its token\n")
        response = await handler(request)
        if not response.prepared:
            own = f"ws://{HOST}:{_port(request)}"
            response.headers.update({key: value.replace("{own}", own) for key, value in _HEADERS.items()})
            if allowed[0]:
                response.set_cookie(name, token, httponly=True, samesite="Strict", max_age=24 * 3600)
        return response

    async def session(request: web.Request) -> web.StreamResponse:
        """Return the address and the token for the messages of the page's script."""
        return web.json_response({"sessionURL": f"ws://{HOST}:{_port(request)}/ws", "secret": token})

    app.middlewares.append(guard)
    app.router.add_post("/paraview/", session)
