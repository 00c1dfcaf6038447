"""Models that were found in one record, for others of the rig."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

from twinlag import _core
from twinlag._files import replace
from twinlag._part import Part

if TYPE_CHECKING:
    from twinlag._answers import Characterisation, Compensation
    from twinlag._record import Record


class Model(Part):
    """A model that was found in one record: time constants, effects, and what was said of it.

    The fields are those of the file that ``twinlag diagnose --save`` writes.
    """

    __slots__ = ()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it as JSON, for `load_model` and for ``--model`` of the program. A file that exists is overwritten."""
        replace(path, json.dumps(self._fields, indent=2, ensure_ascii=False) + "\n")

    def compensate(self, record: Record, **options: Any) -> Compensation:
        """The gas temperature of another record of the rig; options as of `twinlag.compensate`."""
        from twinlag._verbs import compensate

        return compensate(record, model=self, **options)

    def characterise(self, record: Record, **options: Any) -> Characterisation:
        """The time constants of another record of the rig; options as of `twinlag.characterise`."""
        from twinlag._verbs import characterise

        return characterise(record, model=self, **options)

    def __repr__(self) -> str:
        effects = [effect["effect"] for effect in self._fields["effects"]]
        return f"<Model of {' and '.join(self._fields['channels'])}: {', '.join(effects) or 'two lags'}>"


def load_model(path: str | os.PathLike[str]) -> Model:
    """Read a model that `Model.save` or ``twinlag diagnose --save`` has written.

    Raises
    ------
    ValueError
        It is no such file.
    """
    try:
        with open(path, encoding="utf-8") as file:
            text = file.read()
        _core.check_model(text)
    except ValueError as error:  # bytes that are no text among them
        expected = "expected a model written by `twinlag diagnose --save` or Model.save"
        raise ValueError(f"{os.fspath(path)}: {expected}: {error}") from None
    return Model(json.loads(text))
