"""The view of a world: labels, pictures, movies and animations, which its supervisor makes."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from palaestra_trainer.errors import ConfigurationError, WrongData
from palaestra_trainer.webots.observer import Observer
from palaestra_trainer.webots.services import Services
from palaestra_trainer.webots.view_settings import MovieSettings, ViewLabel

_VIEWERS: Final = ("Viewpoint", "Camera", "Lidar", "RangeFinder")


class SupervisedView:
    """Changes and records the view of a world; a part of `Supervisor`.

    Args:
        node_name: the ROS name of the supervisor.
        observer: the observer, which provides handles of nodes and fields.
    """

    def __init__(self, node_name: str, observer: Observer) -> None:
        self.node_name = node_name
        self._observer = observer
        self._services = Services(node_name)

    def set_visible(self, name: str, viewer: str = "", *, visible: bool) -> None:
        """Show or hide the node with DEF `name` in one view; only Webots hides nodes.

        Args:
            name: the DEF name of the node.
            viewer: the DEF name of a Viewpoint, Camera, Lidar or RangeFinder; "": the world's Viewpoint.
            visible: whether the viewer shows the node.

        Raises:
            ConfigurationError: the viewer is a node of another type.
        """
        source = self._observer.node(viewer) if viewer else self._viewpoint()
        kind = self._observer.find(viewer).base_type_name if viewer else "Viewpoint"
        if kind not in _VIEWERS:
            raise ConfigurationError(f"{viewer} is a {kind}; give the DEF name of a {', '.join(_VIEWERS)}")
        wanted = {"node": self._observer.node(name), "from": source, "visible": visible}
        self._confirm("node/set_visibility", "node_set_visibility", name, **wanted)

    def look_at(self, name: str) -> None:
        """Move the view of Webots' window to the node with DEF `name`; other simulators have no window."""
        self._confirm("node/move_viewpoint", "node_move_viewpoint", name, node=self._observer.node(name))

    def save_image(self, path: str | Path, quality: int = 90) -> None:
        """Save the view of the world as a PNG or JPEG file on the simulator's machine.

        Args:
            path: the file; an absolute path.
            quality: 1 to 100, for JPEG.

        Raises:
            WrongData: also if the simulator cannot render (the stub cannot), or cannot write the file.
        """
        self._confirm("export_image", "save_image", path, filename=str(path), quality=quality)

    def start_movie(self, path: str | Path, settings: MovieSettings | None = None) -> None:
        """Record the view of the world from the next step on, as a video file on the simulator's machine.

        Args:
            path: the file; an absolute path.
            settings: size, quality and speed; None: the defaults of `MovieSettings`.

        Raises:
            WrongData: also if the simulator cannot render (the stub cannot).
        """
        wanted = settings or MovieSettings()
        width, height = wanted.size
        self._confirm(
            "movie_start_recording",
            "supervisor_movie_start_recording",
            path,
            filename=str(path),
            width=width,
            height=height,
            codec=0,
            quality=wanted.quality,
            acceleration=wanted.acceleration,
            caption=wanted.caption,
        )

    def stop_movie(self) -> None:
        """End the recording; the file is complete when `movie_is_ready` returns True."""
        self._services.ask("supervisor/movie_stop_recording", "get_bool")

    def movie_is_ready(self) -> bool:
        """Return whether no movie is being recorded or written."""
        service = self._services.get("supervisor/movie_is_ready", "node_get_status")
        return bool(service(ask=True).status)

    def movie_failed(self) -> bool:
        """Return whether the last recording failed."""
        service = self._services.get("supervisor/movie_failed", "node_get_status")
        return bool(service(ask=True).status)

    def start_animation(self, path: str | Path) -> None:
        """Record an animation for web browsers as a file on the simulator's machine; only Webots can do this.

        Args:
            path: the file, whose name ends in .html; an absolute path.
        """
        self._confirm("animation_start_recording", "set_string", path, value=str(path))

    def stop_animation(self) -> None:
        """End the animation; its file is then complete.

        Raises:
            WrongData: also if no animation is recorded.
        """
        if not self._services.ask("supervisor/animation_stop_recording", "get_bool"):
            raise WrongData(self.node_name, "no animation is recorded; call start_animation first")

    def set_label(self, label: ViewLabel) -> None:
        """Show a text over the view of the world; a label of the same number is replaced."""
        self._confirm(
            "set_label",
            "supervisor_set_label",
            repr(label.text),
            id=label.number,
            label=label.text,
            xpos=label.at[0],
            ypos=label.at[1],
            size=label.size,
            color=label.rgb,
            transparency=label.transparency,
            font=label.font,
        )

    def _viewpoint(self) -> int:
        """Return the handle of the world's Viewpoint, the only one in the children of the root."""
        for node in self._observer.find("").nodes():
            if node.base_type_name == "Viewpoint":
                return node.handle
        raise WrongData(self.node_name, "the world has no Viewpoint; give the DEF name of a viewer")

    def _confirm(self, path: str, type_name: str, subject: object, **request: object) -> None:
        """Call a service that only confirms; `subject` is the object of the call, for the message."""
        refused = f"refuses {path.rpartition('/')[2]} for {subject}"
        self._services.confirm(f"supervisor/{path}", type_name, refused, **request)
