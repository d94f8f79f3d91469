"""Formats of numbers in a report."""

from __future__ import annotations

# For an unknown value.
NONE = "–"


def number(value: float | None) -> str:
    """About three digits."""
    if value is None:
        return NONE
    size = abs(value)
    decimals = next((decimals for limit, decimals in ((1, 3), (10, 2), (100, 1), (1e6, 0)) if size < limit), None)
    if decimals is not None:
        return signed(f"{value:.{decimals}f}")
    mantissa, exponent = f"{value:.2e}".split("e")
    return signed(f"{mantissa}e{int(exponent)}")


def signed(digits: str) -> str:
    """With a real minus sign, and none before zero."""
    return digits.replace("-", "−" if set(digits) - set("-0.") else "")


def interval(bounds: list[float] | None) -> str:
    return f"[{number(bounds[0])}, {number(bounds[1])}]" if bounds else ""


def probability(p: float | None) -> str:
    if p is None:
        return NONE
    return "< 0.0001" if p < 1e-4 else f"{p:.4f}"


def integer(value: int) -> str:
    """With a narrow space between thousands."""
    return f"{value:,}".replace(",", "\u202f")
