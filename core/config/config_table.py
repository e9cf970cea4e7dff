"""What all sections of the configuration share: strict, frozen models, and types with bounds.

Annotations of the models are objects (no ``from __future__ import annotations``): pydantic would evaluate each text.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Vec3 = tuple[float, float, float]
Vec6 = tuple[float, float, float, float, float, float]
Interval = tuple[float, float]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
ColumnPattern = str | list[int] | list[str]


class ConfigTable(BaseModel):
    """A table of the configuration: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
