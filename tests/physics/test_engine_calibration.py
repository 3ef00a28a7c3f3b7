"""Calibration to an engine's setting: what is typed is right, and what is said of other loads holds."""

from dataclasses import replace

import numpy as np
import pytest

import springtune as st
from springtune.engines.calibration import SIZES, _range

import engine_scenes

QUESTIONS = 50


def strip(load="traction", force=0.2, size="10 mm", **options):
    """A scene of a soft strip."""
    beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    return st.Scene(beam, st.make_mesh(beam, "structured", size), rubber, load, force, **options)


def question(number):
    """A random scene and setting: body, mesh, load and its size, material, definition, substeps, iterations."""
    random = np.random.default_rng([31, number])

    def pick(those):
        return list(those)[random.integers(len(those))]

    body, load = pick(engine_scenes.BODIES), pick(engine_scenes.LOADS)
    scene = engine_scenes.scene(
        body, pick(("structured", "free", "right")), load, pick(engine_scenes.MATERIALS), pick(("patch", "lattice"))
    )
    force = scene.statement.size * random.uniform(0.2, 1.5)
    scene = st.Scene(scene.beam, scene.mesh, scene.material, load, force, definition=scene.definition)
    setting = st.Setting(
        pick((1 / 60, 1 / 120)), int(random.integers(4, 40)), int(random.integers(2, 20)), pick(("float64", "float32"))
    )
    return scene, setting, random


def answered(number):
    """Check what is said of a random question; return whether there is a factor."""
    scene, setting, random = question(number)
    loads = random.permutation(list(st.LOADS)[:5])[:2]
    fit = st.fit_engine(scene, "xpbd", setting, loads=loads, needed=False)

    def run(scene, factor):
        damping = 2 * scene.motion().loaded_frequency
        return st.in_engine(scene, "xpbd", setting, factor=factor, damping=damping, frames=1200, tolerance=1e-5)

    if fit.factor != fit.factor:
        target = abs(fit.untuned.reference)
        for factor in 10 ** random.uniform(0, 5, 2):
            assert not abs(run(scene, factor).displacement) < target, fit.message
        return False
    found = run(scene, fit.factor)
    assert abs(found.error) < 0.02, (number, found)
    for band in fit.bands:
        for force in random.uniform(band.least, band.most, 2) if band.least == band.least else ():
            other = st.Scene(scene.beam, scene.mesh, scene.material, band.load, force, definition=scene.definition)
            found = run(other, fit.factor)
            assert abs(found.error) <= band.within, (number, band, force, found)
    return True
