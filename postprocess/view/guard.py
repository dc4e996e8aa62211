"""Who may see the page: whoever has the address with its token, on this machine."""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable

from aiohttp import web

HOST = "127.0.0.1"
"""The loopback interface: nobody else's machine reaches it."""

_PARAMETER = "token"
_HOURS = 24

# The page's script compiles its templates as it runs; it may speak to this server and to nobody else.
_POLICY = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; connect-src 'self' {own} data: blob:; "
    "frame-ancestors 'none'; base-uri 'self'; form-action 'none'"
)
_HEADERS = {"Referrer-Policy": "no-referrer", "X-Content-Type-Options": "nosniff", "Cache-Control": "no-store"}

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def new_token() -> str:
    """256 random bits."""
    return secrets.token_urlsafe(32)


def address(port: int, token: str) -> str:
    """What to open in a browser."""
    return f"http://{HOST}:{port}/index.html?{_PARAMETER}={token}"


def protect(app: web.Application, token: str) -> None:
    """Answer 403 to every request, of pages, files and messages alike, that does not bring the token.

    The address brings it once; then a cookie does, which no other site's page can send along. The page may load from
    here and from nowhere else.

    Args:
        app: Before it starts.
        token: See `new_token`.
    """

    @web.middleware
    async def guard(request: web.Request, handler: Handler) -> web.StreamResponse:
        # Cookies are shared by all ports of a machine, so their names are not.
        name = f"smarticles-{request.url.port}"
        brought = request.query.get(_PARAMETER, ""), request.cookies.get(name, "")
        allowed = [secrets.compare_digest(word.encode(), token.encode()) for word in brought]
        if not any(allowed):
            raise web.HTTPForbidden(text="403: open the address that `smarticles view` printed, with its token\n")
        response = await handler(request)
        if response.prepared:
            return response
        response.headers.update(_HEADERS)
        response.headers["Content-Security-Policy"] = _POLICY.format(own=f"ws://{HOST}:{request.url.port}")
        if allowed[0]:
            response.set_cookie(name, token, httponly=True, samesite="Strict", max_age=3600 * _HOURS)
        return response

    async def session(request: web.Request) -> web.StreamResponse:
        """Tells the page's script, which asks for it first, where to send messages and what proves them."""
        return web.json_response({"sessionURL": f"ws://{HOST}:{request.url.port}/ws", "secret": token})

    app.middlewares.append(guard)
    app.router.add_post("/paraview/", session)
