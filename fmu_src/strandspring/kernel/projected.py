"""Linear least squares with columns that stay and columns that move with omega, as variable projection needs it."""

from __future__ import annotations

import numpy as np

from .arrays import FloatArray, address, floats
from .library import library


class ProjectedColumns:
    """The least-squares problem target = fixed*a + (omega*moving)*b in a and b, for many omega.

    What the fixed columns leave is found once. Columns that depend on others get the coefficient 0.

    Parameters
    ----------
    fixed, moving : ndarray, shapes (P, N), (P, M)
    target : ndarray, shape (P,)
    """

    def __init__(self, fixed: FloatArray, moving: FloatArray, target: FloatArray) -> None:
        kernel = library()
        self.points, self.fixed, self.moving = target.size, fixed.shape[1], moving.shape[1]
        frame, triangle = np.array(fixed.T, order="C"), np.empty((self.fixed, self.fixed))
        kernel.projected_frame(self.points, self.fixed, address(frame), address(triangle))
        along, left = np.empty(self.fixed), np.array(target)
        kernel.projected_beside(self.points, self.fixed, address(frame), address(left), address(along))
        self._arrays = frame, triangle, along, floats(moving.T), left
        self.frame, self._triangle, self._along, self.functions, self._target = map(address, self._arrays)

    def at(self, omega: FloatArray) -> Projection:
        """The problem at one omega, shape (P,)."""
        return Projection(self, omega)


class Projection:
    """The least-squares solution at one omega.

    Parameters
    ----------
    columns : ProjectedColumns
    omega : ndarray, shape (P,)

    Attributes
    ----------
    cost : float                              Half the sum of squares of the residuals.
    coefficients : ndarray, shape (N + M,)    Those of the fixed columns first.
    """

    def __init__(self, columns: ProjectedColumns, omega: FloatArray) -> None:
        c = self._columns = columns
        width = c.fixed + c.moving
        # Residuals, then the moving columns beside all others, orthonormal.
        self._rows = np.empty((1 + c.moving, c.points))
        self._residuals = address(self._rows)
        self._own = self._residuals + self._rows.strides[0]
        self.coefficients, workspace = np.empty(width), np.empty((c.moving + 1) * width)
        self.cost: float = library().projected_fit(
            c.points,
            c.fixed,
            c.frame,
            c._triangle,
            c._along,
            c.moving,
            c.functions,
            c._target,
            address(omega),
            self._own,
            address(self.coefficients),
            self._residuals,
            address(workspace),
        )

    def triangle(self, derivatives: FloatArray) -> FloatArray:
        """Upper triangle R of the QR decomposition of [J, residuals], shape (n + 1, n + 1).

        J is the Jacobian of the residuals in Kaufman's form, given the derivatives of omega, shape (n, P).
        """
        c, (parameters, points) = self._columns, derivatives.shape
        triangle = np.empty((parameters + 1, parameters + 1))
        workspace = np.empty((parameters + 1) * points + c.fixed + c.moving)
        library().projected_triangle(
            points,
            c.fixed,
            c.frame,
            c.moving,
            c.functions,
            self._own,
            address(self.coefficients),
            self._residuals,
            parameters,
            address(derivatives),
            address(triangle),
            address(workspace),
        )
        return triangle.T
