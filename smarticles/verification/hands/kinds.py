"""The hands that there are."""

from __future__ import annotations

from smarticles.verification.hands.interface import Hands

ENGINES = ("yade", "links")


def hands_on(engine: str) -> Hands:
    """The hands on an engine."""
    # Imported when asked for: links need no YADE.
    if engine == "yade":
        from smarticles.verification.hands.yade import YadeHands  # noqa: PLC0415

        return YadeHands()
    from smarticles.verification.hands.links import LinksHands  # noqa: PLC0415

    return LinksHands()
