"""An engine for tests, whose responses are told."""

from dataclasses import dataclass
from typing import ClassVar

from simulate.engines.engine import Engine, ResponseSource


@dataclass(frozen=True)
class Told(Engine):
    """Takes the responses of a source."""

    source_told: ResponseSource

    name: ClassVar[str] = "told"
    called: ClassVar[str] = "what was told"

    def source(self, *arguments: object) -> ResponseSource:
        return self.source_told
