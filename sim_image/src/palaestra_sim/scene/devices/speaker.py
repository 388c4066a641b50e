"""Speaker: it plays no sounds and no speech here. A sound ends immediately, unless it loops."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceType

# Source: Webots reference, Speaker.
_LANGUAGES: Final = {
    "pico": ("en-US", "en-UK", "de-DE", "es-ES", "fr-FR", "it-IT"),
    "microsoft": ("en-US", "en-UK", "de-DE", "es-ES", "fr-FR", "it-IT", "zh-CN", "ja-JP"),
}


@dataclass(slots=True, kw_only=True, eq=False)
class Speaker:
    """A speaker; `looping` holds the sounds that play until they are stopped."""

    name: str
    model: str
    engine: str = "pico"
    language: str = "en-US"
    looping: set[str] = field(default_factory=set)

    def stop(self, sound: str) -> None:
        """Stop a sound; "" stops all sounds."""
        if sound:
            self.looping.discard(sound)
        else:
            self.looping.clear()


def _read(part: DevicePart) -> Speaker:
    return Speaker(name=part.name, model=part.text("model"))


def _services(speaker: Speaker) -> tuple[Row, ...]:
    return (*_sounds(speaker), *_speech(speaker))


def _sounds(speaker: Speaker) -> tuple[Row, ...]:
    def play_sound(request: Any) -> Fields:
        if request.loop:
            speaker.looping.add(request.sound)
        return {"success": 1}

    def stop(request: Any) -> Fields:
        speaker.stop(request.value)
        return {"success": True}

    return (
        ("play_sound", "speaker_play_sound", play_sound),
        ("stop", "set_string", stop),
        ("is_sound_playing", "speaker_is_sound_playing", lambda request: _playing(speaker, request.sound)),
    )


def _playing(speaker: Speaker, sound: str) -> Fields:
    return {"value": sound in speaker.looping if sound else bool(speaker.looping)}


def _speech(speaker: Speaker) -> tuple[Row, ...]:
    def set_engine(request: Any) -> Fields:
        known = request.value in _LANGUAGES
        if known:
            speaker.engine = request.value
        return {"success": known}

    def set_language(request: Any) -> Fields:
        known = request.value in _LANGUAGES[speaker.engine]
        if known:
            speaker.language = request.value
        return {"success": known}

    return (
        ("set_engine", "set_string", set_engine),
        ("set_language", "set_string", set_language),
        ("get_engine", "get_string", lambda _: {"value": speaker.engine}),
        ("get_language", "get_string", lambda _: {"value": speaker.language}),
        ("speak", "speaker_speak", lambda _: {"success": 1}),
        ("is_speaking", "get_bool", lambda _: {"value": False}),
    )


SPEAKER: Final = DeviceType(node="Speaker", name="speaker", fields="", read=_read, services=_services)
