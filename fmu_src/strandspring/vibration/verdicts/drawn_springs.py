"""Systems with springs drawn from the uncertainty of their model files.

Springs of one model file are drawn as one, which is the uncertainty of the identification and not the scatter from
mount to mount; those of different files independently. A draw depends on the spring, the seed and its number alone, so
that it is the same in every candidate and at every grid point. A drawn spring begins at the nominal displacement of the
identified one.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass

from ...core.parameters import SpringParameters
from ...errors import ModelError
from ...model.joint import JointCovariance
from ...model.modelfile import ModelFile
from ..bodies.mounted import MountedSystem

_APART = 2**32  # from the draws of one spring to those of the next
_STREAM_BYTES = 8


@dataclass(frozen=True)
class Drawn:
    """Springs that can be drawn, and what cannot.

    Attributes
    ----------
    spreads : mapping        Of each spring with an uncertainty; the second is the number of its own draws.
    missing : tuple of str   A sentence for each model file without one.
    """

    spreads: Mapping[SpringParameters, tuple[JointCovariance, int]]
    missing: tuple[str, ...]

    @classmethod
    def from_models(cls, system: MountedSystem, models: Mapping[str, ModelFile]) -> Drawn:
        """Of a system."""
        names: dict[SpringParameters, str] = {}
        for _, axis in system.axes():
            names.setdefault(axis.spring, axis.model)
        spreads, missing = {}, []
        for spring, name in names.items():
            model = models.get(name)
            try:
                spreads[spring] = (
                    JointCovariance.to_draw_from(spring, model.uncertainty if model else {}),
                    _stream(spring),
                )
            except ModelError as problem:
                missing.append(f"{name or 'A spring'} is taken as known in all draws: {problem}")
        return cls(spreads, tuple(missing))

    def system(self, system: MountedSystem, seed: int, number: int) -> MountedSystem:
        """A system with the springs of one draw.

        Raises
        ------
        ModelError   If hardly any draw of a spring is physically possible.
        """

        def change(spring: SpringParameters) -> SpringParameters:
            if spring not in self.spreads:
                return spring
            spread, stream = self.spreads[spring]
            return spread.draw(spring, seed, number + stream * _APART)

        return system.with_springs(change)


def _stream(spring: SpringParameters) -> int:
    """A number of its own for each spring."""
    digest = hashlib.sha256(json.dumps(spring.as_dict()).encode("utf-8")).digest()
    return int.from_bytes(digest[:_STREAM_BYTES], "big")
