"""One stiffness for traction, compression and a pressed block, or not; and the shape of the pressed face."""

import numpy as np

from ...output import style

LOADS = ("traction", "compression", "pressure")
ENERGIES = ("area", "delingette")
POISSON_LAW = (4 / 3) / (9 / 8)
"""Constrained modulus of a block held sideways at nu = 1/2 over that of a network, nu = 1/3 [1]."""


def draw(tree, folder):
    """Draw the figure ``block``.

    Parameters
    ----------
    tree : xarray.DataTree
        With the groups ``/block`` and ``/sensitivity``.
    folder : str or Path

    Returns
    -------
    list of str
        Stems of the files written.
    """
    root, block = tree.to_dataset(), tree["block"].to_dataset()
    pressed = (root.status != 0).sel(load="pressure")
    material = _last(root.material, pressed)
    beam, mesh_type = _last(root.beam, pressed.sel(material=material)), "structured"
    sizes = pressed.sel(material=material, beam=beam, mesh_type=mesh_type).any(["definition", "kinematics"])
    size = float(sizes.mesh_size.values[sizes.values][0])
    chosen = {"material": material, "beam": beam, "mesh_type": mesh_type, "mesh_size": size}
    with style.figure(folder, "block", ncols=2, figsize=(8.4, 4.2)) as (drawn, (left, right)):
        if "sensitivity" in tree:
            _stiffness(left, tree["sensitivity"].to_dataset().sel(chosen), root.sel(chosen))
        _profile(right, block.sel(chosen), root.sel(chosen))
        title = f"{beam} mm, {mesh_type} {1e3 * size:g} mm, {material}"
        drawn.suptitle(title, x=0.01, y=0.985, ha="left")
        drawn.subplots_adjust(left=0.07, right=0.99, bottom=0.27, top=0.86, wspace=0.2)
    return ["block"]


def _last(coordinate, asked):
    """Last label of a dimension that has anything asked."""
    found = asked.any([name for name in asked.dims if name != coordinate.name])
    return str(coordinate.values[found.values][-1])


def _stiffness(panel, curves, root):
    """Linear kinematics: the reference's own, so that only the law of stiffness is seen."""
    curves = curves.sel(kinematics="linear")
    membrane = float(root.material_young_modulus) * 1e-3
    for number, load in enumerate(LOADS):
        if load in curves["load"]:
            curve = curves.sel(load=load)
            # A linear network's displacement goes as 1/k.
            stiffness = np.linspace(float(curve.stiffness.min()), float(curve.stiffness.max()), 600)
            softness = curve.displacement.values[0] * curve.stiffness.values[0]
            error = 100 * np.abs(softness / stiffness / float(root.reference_displacement.sel(load=load)) - 1)
            look = style.line(number) | {"marker": ""}
            panel.plot(stiffness, error, label=load, **look)
    stated = float(root.paper_stiffness.max()) if np.isfinite(root.paper_stiffness).any() else np.nan
    predicted = np.sqrt(3) / 2 * membrane
    printed = root.stiffness.sel(definition="paper").values if "paper" in root.definition.values else np.array([np.nan])
    known = printed[np.isfinite(printed)]
    stated = known[0] if len(known) else stated
    marks = {f"{stated:.0f}: the paper's, from traction": stated, f"{predicted:.0f}: √3/2 E t": predicted}
    marks[f"{predicted * POISSON_LAW:.0f}: fits the block by a wrong ν"] = predicted * POISSON_LAW
    for text, value in marks.items():
        if np.isfinite(value):
            panel.axvline(value, color="0.5", linewidth=0.8, linestyle=(0, (2, 2)), zorder=1)
            panel.annotate(
                text, (value, 0.97), xycoords=("data", "axes fraction"), xytext=(2, 0), textcoords="offset points",
                rotation=90, va="top", fontsize=6.2, color="0.3",
            )  # fmt: skip
    for number, definition in enumerate(name for name in ENERGIES if name in root.definition.values):
        errors = 100 * np.abs(root.deformation_error.sel(definition=definition, kinematics="linear", load=list(LOADS)))
        look = style.line(3 + number) | {"marker": ""}
        worst = float(errors.max())
        panel.axhline(worst, label=f"{definition}, worst of the three ({worst:.2f} %)", **look)
    panel.set(ylim=(0, 40), xlabel="Uniform stiffness [N/m]", ylabel="|Deformation error| [%]")
    panel.set_xlim(0.7 * predicted, 1.5 * predicted)
    panel.set_title("One stiffness for three loads? (small strain)")
    panel.legend(loc="upper center", fontsize=6.4, bbox_to_anchor=(0.5, -0.17), ncols=2)


def _profile(panel, block, root):
    """The pressed face: networks with their full length law over references."""
    x = block.face_position.values
    pressed = block.sel(load="pressure")
    for number, kind in enumerate(block.reference.values):
        profile = -1e3 * pressed.reference_face_profile.sel(reference=kind).values
        if np.isfinite(profile).any():
            shade = ("0.55", "0.3", "0.75")[number % 3]
            panel.plot(x, profile, color=shade, linewidth=3.2, alpha=0.6, label=f"reference, {kind.replace('-', ' ')}")
    for number, definition in enumerate(block.definition.values):
        linear = definition in ENERGIES
        profile = pressed.face_profile.sel(definition=definition, kinematics="linear" if linear else "nonlinear")
        if np.isfinite(profile.values).any():
            look = style.line(number) | {"marker": ""}
            panel.plot(x, -1e3 * profile.values, label=f"{definition}, {'linear' if linear else 'nonlinear'}", **look)
    panel.set(xlabel="Place on the loaded face over its length", ylabel="Displacement along the load [mm]")
    panel.set_title("The pressed face")
    panel.set_ylim(2.0, None)
    panel.legend(loc="upper center", fontsize=6.4, bbox_to_anchor=(0.5, -0.17), ncols=2)
