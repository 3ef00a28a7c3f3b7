"""A plate with a hole: displacement, and the stress at the rim of the hole.

The hole is a fifth of the plate's width. The stress beside it is 3.13 times the far stress: Howland's solution, by the
polynomial of Peterson's "Stress Concentration Factors".
"""

import matplotlib.pyplot as plt

import springtune as st


def main():
    """Return the stress at the rim of the hole over the far stress."""
    force, width, thickness = 20e3, 0.1, 1e-3
    pull = st.LoadCase(
        "pull",
        supports=[st.Support("left", x=0), st.Support("corner", y=0)],
        tractions=[st.Traction("right", (force, 0))],
        quantities=[
            st.Quantity("end", "displacement", "right", "x"),
            st.Quantity("rim", "stress", "rim", "xx"),
            st.Quantity("carried", "reaction", "left", "x"),
        ],
    )
    plate = st.Shape.rectangle(
        "200 mm",
        width,
        thickness=thickness,
        holes=[st.Hole.circle(("100 mm", "50 mm"), "10 mm")],
        points={"corner": (0, 0), "rim": ("100 mm", "60 mm")},
        loads={"pull": pull},
    )
    grouped = st.mesh_shape(plate, "5 mm", refined={"hole": "0.4 mm"})
    steel = st.Material("210 GPa", 0.3, name="steel")
    scene = st.Scene(plate, grouped, steel, "pull", definition="delingette", kinematics="linear")
    result = scene.solve()
    print(f"{scene}: {result.status}")
    for name, value in result.values.items():
        print(f"{name}: {value:.4g}, error {100 * result.errors[name]:+.2f} %")
    result.plot()
    plt.close()
    print("best on this mesh:", st.predict(plate, grouped, steel)[0].definition)
    return result.values["rim"] / (force / (width * thickness))


if __name__ == "__main__":
    main()
