"""Commands that a bench would send: ramps, multisines, steps as a 10 Hz policy makes them, holds and fast steps."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def _filtered(targets: Array, time_constant: float, rate: float) -> Array:
    """First-order low pass over (samples, joints), starting at the first target."""
    out, keep = np.empty_like(targets), np.exp(-1.0 / (time_constant * rate))
    state = targets[0]
    for k, target in enumerate(targets):
        state = keep * state + (1 - keep) * target
        out[k] = state
    return out


def _stepped(rng: np.random.Generator, low: Array, high: Array, samples: int, hold: float, rate: float) -> Array:
    """Random targets, each held `hold` seconds."""
    count = int(np.ceil(samples / (hold * rate))) + 1
    targets = rng.uniform(low, high, size=(count, len(low)))
    return targets[(np.arange(samples) / (hold * rate)).astype(int)]


def ramps(rng: np.random.Generator, low: Array, high: Array, samples: int, rate: float) -> Array:
    """Triangles, each joint at a speed and phase of its own, two speeds in one trial."""
    time = np.arange(samples) / rate
    speed = np.where(time < 0.6 * time[-1], 1.0, rng.uniform(0.25, 0.6))
    phase = np.cumsum(speed)[:, None] / rate * rng.uniform(0.2, 0.5, len(low)) / (high - low) + rng.uniform(
        0, 2, len(low)
    )
    return low + (high - low) * (1.0 - np.abs(np.mod(phase, 2.0) - 1.0))


def multisine(rng: np.random.Generator, low: Array, high: Array, samples: int, rate: float) -> Array:
    """Eight sines up to 3-4 Hz with falling amplitudes."""
    time = np.arange(samples)[:, None] / rate
    out = np.zeros((samples, len(low)))
    for frequency in np.geomspace(0.1, rng.uniform(2.5, 4.0), 8):
        out += frequency**-0.6 * np.sin(
            2 * np.pi * (frequency * rng.uniform(0.9, 1.1, len(low)) * time + rng.uniform(size=len(low)))
        )
    out /= np.abs(out).max(axis=0)
    return low + (high - low) * (0.5 + 0.45 * out)


def policy(rng: np.random.Generator, low: Array, high: Array, samples: int, rate: float) -> Array:
    """Targets of a 10 Hz policy through its low pass, after a short wait."""
    targets = _stepped(rng, low, high, samples, float(rng.choice([0.2, 0.3, 0.5])), rate)
    targets[: int(0.3 * rate)] = targets[0]
    return _filtered(targets, rng.uniform(0.1, 0.3), rate)


def holds(rng: np.random.Generator, low: Array, high: Array, samples: int, rate: float) -> Array:
    """Postures, each approached fast and held."""
    return _filtered(
        _stepped(rng, low, high, samples, float(rng.choice([1.5, 2.0])), rate), rng.uniform(0.06, 0.15), rate
    )


def steps(rng: np.random.Generator, low: Array, high: Array, samples: int, rate: float) -> Array:
    """Postures, each commanded within some 30 ms and held half a second: the controller asks for all that it may."""
    return _filtered(_stepped(rng, low, high, samples, 0.5, rate), 0.03, rate)


KINDS = {"ramps": ramps, "multisine": multisine, "policy": policy, "holds": holds}
"""What the rounds draw from."""
COMMANDS = KINDS | {"steps": steps}
"""By name."""
