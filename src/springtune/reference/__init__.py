"""Converged finite-element references for the networks.

`small_strain` solves beams and `shapes` shapes, `finite_strain` and `finite_shapes` do so at finite strain;
`interpolant` answers for many beams, `by_constants` for many materials. `answers` is what is done with a solution.
`coarse_meshes` and `triangles` are the elements of shapes, and `calculix` is a second opinion.
"""
