"""Polynomial response surfaces: least squares on factors scaled to [-1, 1], coefficients in natural units.

    model = fit_polynomial(X, y, space=space, terms=parse_terms(["1", "D", "M", "D^2", "D*M"], space.names))
    model.coefficients()     # in natural units
    model.anova()            # what each term contributes
    model.press              # prediction error sum of squares

Terms are chosen in the scaled factors. If every divisor of every term is among them (see `is_hierarchical`) the
polynomial has the same terms in natural units; otherwise multiplying out brings in lower terms, which
`Polynomial.coefficients` lists too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import qr, solve_triangular
from scipy.special import fdtrc

from trainmj.doe.arrays import FloatArray, as_matrix, as_vector, frozen, varies
from trainmj.doe.space import Space
from trainmj.doe.terms import Term, check_terms, columns, expand, term_name
from trainmj.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

COLLINEAR = 1e-9
"""Part of a column's length that must be new; columns of scaled factors lie far above it, or at round-off."""


@dataclass(frozen=True)
class Polynomial:
    """A fitted response surface.

    Attributes:
        space: the factors.
        terms: exponents of each term, in scaled factors.
        y: the fitted response, (n,).
        scaled: coefficient of each term in scaled factors, (p,).
        q: orthonormal basis of the terms' columns, (n, p).
        r: upper triangle with columns = q @ r, (p, p).
    """

    space: Space
    terms: tuple[Term, ...]
    y: FloatArray = field(repr=False)
    scaled: FloatArray = field(repr=False)
    q: FloatArray = field(repr=False)
    r: FloatArray = field(repr=False)

    @property
    def description(self) -> str:
        """The terms, in a line."""
        return "polynomial in " + ", ".join(self.term_names)

    @property
    def term_names(self) -> tuple[str, ...]:
        """The terms as text: 1, D, M^2, D*M."""
        return tuple(term_name(t, self.space.names) for t in self.terms)

    @property
    def dof(self) -> int:
        """Degrees of freedom of the residuals: points less terms."""
        return len(self.y) - len(self.terms)

    @property
    def residuals(self) -> FloatArray:
        """Computed less fitted values, (n,)."""
        return self.y - self.q @ (self.q.T @ self.y)

    @property
    def leverage(self) -> FloatArray:
        """Weight of each point in its own fitted value, between 0 and 1, (n,)."""
        return np.asarray((self.q**2).sum(axis=1), dtype=np.float64)

    @property
    def sigma(self) -> float:
        """Standard deviation of the residuals, in the unit of the response.

        Raises:
            InputError: as many terms as points.
        """
        self._need_freedom("the residual standard deviation")
        return float(np.sqrt((self.residuals**2).sum() / self.dof))

    @property
    def press(self) -> float:
        """Sum of squared leave-one-out errors (Allen 1974, doi 10.1080/00401706.1974.10489157)."""
        return float(((self.y - self.leave_one_out()) ** 2).sum())

    def predict(self, x: ArrayLike) -> FloatArray:
        """Predict the response (n,) at natural values (n, d)."""
        return np.asarray(columns(self.space.to_coded(x), self.terms) @ self.scaled, dtype=np.float64)

    def leave_one_out(self) -> FloatArray:
        """Predict each fitted point from all others, (n,), without fitting again.

        Raises:
            InputError: as many terms as points, or a point that alone determines a term.
        """
        self._need_freedom("leave-one-out errors and PRESS")
        leverage = self.leverage
        alone = np.flatnonzero(leverage > 1.0 - 1e-9)
        if alone.size:
            raise InputError(
                f"points {alone.tolist()} each determine a term alone (leverage 1), so the others cannot predict them; "
                "use fewer terms or more points"
            )
        return np.asarray(self.y - self.residuals / (1.0 - leverage), dtype=np.float64)

    def coefficients(self) -> pd.Series:
        """The coefficients in natural units, by term."""
        import pandas as pd

        centre, half = (self.space.lower + self.space.upper) / 2, (self.space.upper - self.space.lower) / 2
        natural = expand(self.terms, self.scaled, centre, half)
        order = [*self.terms, *sorted(set(natural) - set(self.terms), key=lambda t: (sum(t), t))]
        return pd.Series({term_name(t, self.space.names): natural[t] for t in order}, name="coefficient")

    def anova(self) -> pd.DataFrame:
        """The analysis of variance: model, each term given all others, residuals, total.

        Returns:
            A row each: sum_of_squares, dof, mean_square, F, p. The rows of the terms do not add up to that of the
            model: each is what the fit loses without that term alone, with the factors scaled to [-1, 1].

        Raises:
            InputError: as many terms as points.
        """
        import pandas as pd

        self._need_freedom("an analysis of variance")
        constant = tuple([0] * self.space.d) in self.terms
        total = float((self.y**2).sum() - (len(self.y) * self.y.mean() ** 2 if constant else 0.0))
        left = float((self.residuals**2).sum())
        inverse = solve_triangular(self.r, np.eye(len(self.terms)))  # (p, p)
        alone = self.scaled**2 / (inverse**2).sum(axis=1)
        variance = self.sigma**2
        if constant and not varies(self.y):  # all of it is round-off: F and p are 0 / 0
            total, left, alone, variance = 0.0, 0.0, np.zeros_like(alone), np.nan
        rows = [("model", total - left, len(self.terms) - constant)]
        rows += [(name, float(s), 1) for name, s, t in zip(self.term_names, alone, self.terms, strict=True) if any(t)]
        rows += [("residuals", left, self.dof), ("total", total, len(self.y) - constant)]
        table = pd.DataFrame(rows, columns=["source", "sum_of_squares", "dof"]).set_index("source")
        table["mean_square"] = table["sum_of_squares"] / table["dof"].where(table["dof"] > 0)
        table["F"] = table["mean_square"] / variance
        table["p"] = [float(fdtrc(max(k, 1), self.dof, f)) for k, f in zip(table["dof"], table["F"], strict=True)]
        table.loc[["residuals", "total"], ["F", "p"]] = np.nan
        return table

    def _need_freedom(self, what: str) -> None:
        if self.dof < 1:
            raise InputError(
                f"{what} needs more points than terms (got {len(self.y)} points for {len(self.terms)} terms): the "
                "surface passes through every point whatever its error; use fewer terms or more points"
            )


def fit_polynomial(x: ArrayLike, y: ArrayLike, *, space: Space, terms: Sequence[Term]) -> Polynomial:
    """Fit a polynomial by least squares (QR, factors scaled to [-1, 1]).

    Args:
        x: natural values, (n, d).
        y: response, (n,).
        space: the factors.
        terms: exponents of each term; see `parse_terms` and `full_order`.

    Raises:
        InputError: fewer points than terms, or terms that these points cannot tell apart; the message names them.
    """
    x = as_matrix("x", x, space.d)
    y = as_vector("y", y, len(x))
    terms = check_terms(list(terms), space.d)
    if len(y) < len(terms):
        raise InputError(
            f"a polynomial needs at least as many points as terms (got {len(y)} points for {len(terms)} terms)"
        )
    basis = columns(space.to_coded(x), terms)
    _check_collinear(x, basis, terms, space)
    q, r = np.linalg.qr(basis)
    scaled = solve_triangular(r, q.T @ y)
    return Polynomial(space, terms, *(frozen(a) for a in (y, scaled, q, r)))


def _check_collinear(x: FloatArray, basis: FloatArray, terms: Sequence[Term], space: Space) -> None:
    """Refuse terms whose columns (n, p) are combinations of the others at the points x (n, d)."""
    length = np.linalg.norm(basis, axis=0)
    unit = basis / np.where(length > 0, length, 1.0)
    r, pivot = qr(unit, mode="r", pivoting=True)
    lost = pivot[np.abs(np.diag(r)) < COLLINEAR]
    if lost.size:
        names = [term_name(terms[i], space.names) for i in sorted(lost)]
        distinct = {name: len(np.unique(column)) for name, column in zip(space.names, x.T, strict=True)}
        raise InputError(
            f"these {len(x)} points cannot tell the terms {names} from the others (a power k needs k + 1 distinct "
            f"values of its factor; distinct values here: {distinct}); leave terms out or add points"
        )
