"""What a volume is made of, before it becomes a medium: terms, each a factor times a field."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Color = NDArray[np.float64]


def color(value: Any) -> Color:
    """One number or three as three."""
    array = np.asarray(value, dtype=float).reshape(-1)
    return np.repeat(array, 3) if array.size == 1 else array[:3]


@dataclass(frozen=True)
class Term:
    """``factor`` times the values of ``fields``, which are names of a volume's fields."""

    factor: Color = field(default_factory=lambda: np.ones(3))
    fields: tuple[str, ...] = ()

    def __mul__(self, other: Term) -> Term:
        return Term(self.factor * other.factor, self.fields + other.fields)

    def scaled(self, factor: Any) -> Term:
        return replace(self, factor=self.factor * color(factor))


NOTHING = Term(np.zeros(3))


@dataclass
class Optics:
    """Coefficients per unit of length of the stage.

    Either ``scattering`` and ``absorption`` are given, or ``extinction`` and ``albedo``.
    """

    extinction: Term = NOTHING
    albedo: Term = field(default_factory=Term)
    g: float = 0.0
    g2: float = 0.0
    mix: float = 0.0
    """Share of the second lobe."""
    emission: Term = NOTHING
    """Radiance per length."""
    temperature: Term | None = None
    """Kelvin; emits as a black body."""
    blackbody: float = 0.0
    """Factor of absolute black-body radiance, 1/length."""

    def of_coefficients(self, absorption: Term, scattering: Term) -> str | None:
        """Sets extinction and albedo. Returns what is lost if their fields differ, which no medium can show."""
        dark_a, dark_s = not absorption.factor.any(), not scattering.factor.any()
        if dark_a or dark_s:
            self.extinction = absorption if dark_s else scattering
            self.albedo = Term(np.full(3, 0.0 if dark_s else 1.0))
            return None
        total = absorption.factor + scattering.factor
        share = np.divide(scattering.factor, total, out=np.zeros(3), where=total > 0.0)
        self.extinction, self.albedo = Term(total, scattering.fields), Term(share)
        if absorption.fields != scattering.fields:
            return "absorption and scattering come from different fields; those of scattering are used for both"
        return None


# CIE 1931 luminosity by wavelength (nm), the fit of Wyman, Sloan & Shirley 2013, listing 1.
def _luminosity(nm: NDArray[np.float64]) -> NDArray[np.float64]:
    def lobe(height: float, middle: float, below: float, above: float) -> NDArray[np.float64]:
        t = (nm - middle) / np.where(nm < middle, below, above)
        return np.asarray(height * np.exp(-0.5 * t * t))

    return lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1)


def planck_luminance(kelvin: float) -> float:
    """∫ B_λ(T) ȳ dλ, W·sr⁻¹·m⁻²: the luminance, over 683 lm/W, of the black bodies that the medium knows."""
    nm = np.arange(360.0, 831.0)
    metres = nm * 1e-9
    planck = 1.191042972e-16 / metres**5 / np.expm1(1.438776877e-2 / (metres * kelvin))
    return float((planck * _luminosity(nm)).sum() * 1e-9)


def stefan_factor(kelvin: float) -> float:
    """Factor that gives black bodies, at this temperature, the luminance 10⁻⁶ σ T⁴/π that Cycles and Arnold give them."""
    return float(1e-6 * 5.670374419e-8 * kelvin**4 / np.pi / planck_luminance(kelvin))
