"""Systems with springs drawn from the uncertainty of their model files, and from the scatter of their mounts.

Springs of one model file are drawn as one, which is the uncertainty of the identification; those of different files
independently. The scatter from mount to mount is a `Tolerance`: factors on all springs of a mount, drawn for each mount
or for all of one type. A draw depends on the spring, the seed and its number alone, so
that it is the same in every candidate and at every grid point. A drawn spring begins at the nominal displacement of the
identified one.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import ModelError
from ...findings import Finding, Outcome
from ...model.joint import JointCovariance
from ...model.modelfile import ModelFile
from ..bodies.mounted import MountedSystem
from ..bodies.parts import Mount, scaled

_APART = 2**32  # from the draws of one spring to those of the next
_STREAM_BYTES = 8


@dataclass(frozen=True)
class Drawn:
    """Springs that can be drawn, and what cannot.

    Attributes
    ----------
    spreads : mapping        Of each spring with an uncertainty; the second is the number of its own draws.
    missing : tuple of Finding   Of each model file without one.
    """

    spreads: Mapping[SpringParameters, tuple[JointCovariance, int]]
    missing: tuple[Finding, ...]

    @classmethod
    def from_models(cls, system: MountedSystem, models: Mapping[str, ModelFile]) -> Drawn:
        """Of a system."""
        names: dict[SpringParameters, str] = {}
        for axis in system.axes:
            if axis.stated_amplitude is None:  # of a catalogue, of which other cautions tell
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
                numbers = {"model": name or "A spring", "reason": str(problem)}
                missing.append(Finding(Outcome.TAKEN_AS_KNOWN, numbers))
        return cls(spreads, tuple(missing))

    def has_any(self, system: MountedSystem) -> bool:
        """Whether any spring or mount of a system is drawn."""
        return bool(self.spreads) or any(mount.tolerance is not None for mount in system.mounts)

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

        drawn = system.with_springs(change)
        mounts = tuple(_scattered(mount, seed, number) for mount in drawn.mounts)
        return drawn if mounts == drawn.mounts else replace(drawn, mounts=mounts)


def _scattered(mount: Mount, seed: int, number: int) -> Mount:
    """A mount with the factors of one draw on its springs."""
    tolerance = mount.tolerance
    if tolerance is None:
        return mount
    key = f"type {mount.type_name}" if tolerance.batch else f"mount {mount.name}"
    generator = np.random.default_rng((seed, number, _number_of(key)))
    stiffness, friction = 1.0 + np.array([tolerance.stiffness, tolerance.friction]) * generator.uniform(-1.0, 1.0, 2)
    axes = (replace(axis, spring=scaled(axis.spring, float(stiffness), float(friction))) for axis in mount.axes)
    return replace(mount, axes=tuple(axes))


def _stream(spring: SpringParameters) -> int:
    """A number of its own for each spring."""
    return _number_of(json.dumps(spring.as_dict()))


def _number_of(text: str) -> int:
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return int.from_bytes(digest[:_STREAM_BYTES], "big")
