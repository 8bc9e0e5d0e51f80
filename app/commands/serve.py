"""`himpc-lab` itself: the page."""

from __future__ import annotations


def serve(
    scene: str | None = None,
    urdf: str | None = None,
    tip: str | None = None,
    max_sessions: int = 4,
    host: str = "127.0.0.1",
    port: int = 8080,
    no_browser: bool = False,
) -> int:
    """Open the page: a robot under HIMPC whose target you can drag.

    Args:
        scene: scene to start with; iiwa14-hold by default, hold with --urdf.
        urdf: URDF file of your own robot.
        tip: its end-effector frame.
        max_sessions: how many people may use it at once.
        host: address to listen on; only this machine can reach the default.
        port: port to listen on.
        no_browser: do not open a browser.
    """
    from app.server import serve as serve_page

    return serve_page(
        scene=scene or ("hold" if urdf else "iiwa14-hold"),
        urdf=urdf,
        tip=tip,
        host=host,
        port=port,
        max_sessions=max_sessions,
        open_browser=not no_browser,
    )
