"""The finite-element side: converged answers that the networks are compared with, one module a kind of reference."""
