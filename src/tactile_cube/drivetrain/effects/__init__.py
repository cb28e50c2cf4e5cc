"""The catalogue of physical effects: one class each, used in training, fitting and search."""

from tactile_cube.drivetrain.effects.catalogue import catalogue as catalogue
from tactile_cube.drivetrain.effects.catalogue import find_effect as find_effect
from tactile_cube.drivetrain.effects.catalogue import import_own_effects as import_own_effects
from tactile_cube.drivetrain.effects.catalogue import matching_joints as matching_joints
from tactile_cube.drivetrain.effects.catalogue import parse_effect as parse_effect
from tactile_cube.drivetrain.effects.catalogue import resolve as resolve
from tactile_cube.drivetrain.effects.effect import Effect as Effect
from tactile_cube.drivetrain.effects.effect import Parameter as Parameter
from tactile_cube.drivetrain.effects.effect import Place as Place
from tactile_cube.drivetrain.effects.effect import Stage as Stage
from tactile_cube.drivetrain.signals import *  # noqa: F403 - what a law can see
