"""Refinement: values of a parameter added where the deformation error changes its sign or crosses a tolerance."""
