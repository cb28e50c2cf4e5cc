"""Which effects exist, and how a user names them: `stribeck_friction@q3`, `my_rig.CableDrag@q2`, `cogging`."""

import re
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from tactile_cube.composition import suggestion
from tactile_cube.drivetrain.effects.effect import Effect, Stage
from tactile_cube.drivetrain.signals import ROWS
from tactile_cube.errors import InputError

EffectClass = type[Effect]
CATALOGUE_MODULES = (
    "command", "motor", "elastic_joint", "transmission", "joint_torque", "friction", "mechanism"
)  # fmt: skip
"""Files of this folder; effects of one stage act in the order in which these define them."""


@cache
def catalogue() -> dict[str, EffectClass]:
    """Return all effects of this package by name, in the order in which they act."""
    package = __package__ or __name__.rpartition(".")[0]
    modules = (import_module(f"{package}.{name}") for name in CATALOGUE_MODULES)
    found = (
        value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Effect) and value.__module__ == module.__name__
    )
    return {effect.name: effect for effect in found}


def find_effect(name: str) -> EffectClass:
    """Return an effect by its catalogue name, or a user's own class by its dotted path.

    Nothing is imported for a dotted path, because names come from files of any origin: see `import_own_effects`.

    Raises:
        InputError: there is no such effect.
    """
    if name in catalogue():
        return catalogue()[name]
    if "@" in name:
        raise InputError(f"effect '{name}': name no joint here, all are asked about; `identify` fits one at a joint")
    if "." not in name:
        every = f"; use one of {', '.join(catalogue())}, or a dotted path to your own class"
        raise InputError(f"effect '{name}' is unknown{suggestion(name, catalogue()) or every}")
    return _own_effect(name)


def parse_effect(text: str, find: Callable[[str], Any] = find_effect) -> tuple[str, dict[str, float]]:
    """Return `NAME@JOINT` and parameter -> value; parameters that are not given take their typical values.

    Raises:
        InputError: an unknown effect or parameter, or a value that is no number.
    """
    name, _, assignments = text.partition(":")
    name = name.strip()
    parameters = {one.name: one.typical for one in find(name.partition("@")[0]).parameters}
    for assignment in filter(None, (part.strip() for part in assignments.split(","))):
        key, equals, value = (part.strip() for part in assignment.partition("="))
        if key not in parameters or not equals:
            raise InputError(f"effect: '{assignment}' in '{text}': {name} has the parameters {sorted(parameters)}")
        try:
            parameters[key] = float(value)
        except ValueError:
            raise InputError(f"effect: '{assignment}' in '{text}': '{value}' is no number") from None
    return name, parameters


def import_own_effects(names: Iterable[str]) -> None:
    """Import the modules of a user's own classes, so that files may name them; other names are ignored.

    Names are as the user wrote them, never from a file: `my_rig.CableDrag`, `my_rig.CableDrag@q2: tension=0.1`.

    Raises:
        InputError: a module that cannot be imported, or has no such effect.
    """
    for name in names:
        path = re.split("[:@(]", name, maxsplit=1)[0].strip()
        module = path.rpartition(".")[0]
        if not module:
            continue
        if str(Path.cwd()) not in sys.path:
            sys.path.append(str(Path.cwd()))  # a user's file lies in the folder of the command
        try:
            import_module(module)
        except Exception as error:  # the user's file may raise anything
            folder = "" if not isinstance(error, ModuleNotFoundError) else "; run from the folder of its file"
            raise InputError(f"effect '{path}': cannot import '{module}': {error}{folder}") from None
        _try_laws(_own_effect(path), path)


def _try_laws(effect: EffectClass, path: str) -> None:
    from tactile_cube.compiled import compiled  # Numba takes half a second; most commands have no such class

    x = np.random.default_rng(0).uniform(-1.0, 1.0, (ROWS, 3))
    neutral, step = np.array([one.neutral for one in effect.parameters]), 1e-3
    stages = {"law": effect.stage, "torque_law": Stage.MOTOR_TORQUE, "ahead_law": Stage.POSITION_SENSOR}
    for name, stage in stages.items():
        law = getattr(effect, name)
        for call in (law, compiled(law)) if effect.defines(name) else ():
            where = f"effect '{path}': {name}(x, j, p, s, dt)"
            try:
                value = call(x.copy(), 1, neutral, np.zeros(effect.kept(step)), step)
            except Exception as error:  # a user's law may raise anything, and Numba says in many lines what it refuses
                said = ": ".join(line.strip() for line in str(error).splitlines() if line.strip())[:300]
                raise InputError(f"{where}: {type(error).__name__}: {said}") from None
            if value != x[stage.value, 1]:
                raise InputError(
                    f"{where}: makes {value} of {x[stage.value, 1]} with neutral parameters; it must change nothing"
                )


def resolve(names: Sequence[str], joints: Sequence[str]) -> list[tuple[EffectClass, str]]:
    """Return effects and joints for names such as `backlash@q3`; without `@JOINT` an effect acts on every joint.

    `@q3` also stands for every joint that ends in `_q3`, `/q3` or `.q3`.

    Raises:
        InputError: an unknown effect or joint.
    """
    placed = []
    for text in names:
        name, at, joint = text.partition("@")
        effect = find_effect(name)
        found = matching_joints(joint, joints) if at else list(joints)
        placed += [(effect, match) for match in found]
    return placed


def named_joints(joint: str, joints: Sequence[str]) -> list[str]:
    """Return the joint of that name, or else those whose name ends in it after `_`, `/` or `.`; there may be none."""
    if joint in joints:
        return [joint]
    return [name for name in joints if joint and name.endswith(tuple(mark + joint for mark in "_/."))]


def matching_joints(joint: str, joints: Sequence[str]) -> list[str]:
    """Return the joint of that name, or else those whose name ends in it after `_`, `/` or `.` (one per finger).

    Raises:
        InputError: there is none.
    """
    found = named_joints(joint, joints)
    if not found:
        near = suggestion(joint, [*joints, *(re.split("[_/.]", name)[-1] for name in joints)])
        raise InputError(f"joint '{joint}' is unknown; the joints are {', '.join(joints)}{near}")
    return found


def _own_effect(path: str) -> EffectClass:
    module_name, _, class_name = path.rpartition(".")
    if module_name not in sys.modules:
        raise InputError(
            f"effect '{path}' is a class of its owner's, whose code no file can have run; if you trust it, name it "
            f"yourself: own_effects=[{path}] on the command line, import {module_name} in a program"
        )
    found = vars(sys.modules[module_name]).get(class_name)  # getattr would let a module import another one
    if not (isinstance(found, type) and issubclass(found, Effect)):
        raise InputError(f"effect '{path}': '{module_name}' has no subclass of Effect named '{class_name}'")
    return found
