"""Tables of pandas, which is imported at the first use."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pandas import DataFrame


def pandas() -> Any:
    """The package."""
    try:
        import pandas
    except ImportError as error:
        raise ImportError("tables need pandas and pyarrow: pip install pandas pyarrow") from error
    return pandas


def of_parquet(record: bytes) -> DataFrame:
    """The table of a mission's record."""
    return pandas().read_parquet(io.BytesIO(record))
