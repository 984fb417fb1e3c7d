"""The effects of a rig by name, and what options say of them."""

from __future__ import annotations

from enum import Enum


class Effect(Enum):
    """Effects of a rig; the value is the name in the model file."""

    DELAY = "delay"
    VISCOSITY = "viscosity"
    PLAY = "play"
    FORCE_ZERO = "force_zero"
    DISPLACEMENT_ZERO = "displacement_zero"
    DRIFT = "drift"
    CURVED_DRIFT = "curved_drift"
    FRICTION_WEAR = "friction_wear"
    STIFFNESS_WEAR = "stiffness_wear"


# Effects of the rig by the names of the option that keeps them in the spring.
KEEP = {
    "delay": (Effect.DELAY,),
    "viscosity": (Effect.VISCOSITY,),
    "play": (Effect.PLAY,),
    "zeros": (Effect.FORCE_ZERO, Effect.DISPLACEMENT_ZERO),
    "drift": (Effect.DRIFT, Effect.CURVED_DRIFT),
    "wear": (Effect.FRICTION_WEAR, Effect.STIFFNESS_WEAR),
    "all": tuple(Effect),
}
# Which spring a model describes, if the test changes it.
STATES = ("first", "mean", "last")
USUAL_STATE = "mean"
