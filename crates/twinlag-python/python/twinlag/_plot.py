"""Pictures by matplotlib, where it is installed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from twinlag._answers import Compensation, Diagnosis, Track

Z_975 = 1.959963984540054
"""Half width of a 95 % interval in standard deviations."""


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained")[1]


def gas(answer: Compensation, ax: Any) -> Any:
    """The gas temperature with its 95 % band."""
    ax = _axes(ax)
    half = Z_975 * answer.gas_std_k
    ax.fill_between(answer.time_s, answer.gas_c - half, answer.gas_c + half, alpha=0.3, linewidth=0, label="95 %")
    ax.plot(answer.time_s, answer.gas_c, linewidth=1, label=f"gas ({answer.grade})")
    ax.set(xlabel="time (s)", ylabel="temperature (°C)")
    ax.legend()
    return ax


def track(answer: Track, ax: Any) -> Any:
    """Both time constants with their 95 % bands."""
    ax = _axes(ax)
    for number, channel in zip((1, 2), answer.sensors):
        tau, low, high = (answer.series(f"tau{number}_{name}s") for name in ("", "low_", "high_"))
        (line,) = ax.plot(answer.time_s, tau, linewidth=1, label=channel)
        ax.fill_between(answer.time_s, low, high, alpha=0.3, linewidth=0, color=line.get_color())
    ax.set(xlabel="time (s)", ylabel="time constant (s)", yscale="log")
    ax.legend()
    return ax


def time_constants(answer: Diagnosis, ax: Any) -> Any:
    """Both time constants with their 95 % intervals, by two lags and with the effects."""
    from twinlag._part import Sensors

    ax = _axes(ax)
    models = {"two lags": Sensors(answer._fields["base"]["sensors"]), "with effects": answer.sensors}
    for place, (name, sensors) in enumerate(models.items()):
        for row, sensor in enumerate(sensors.values()):
            if sensor.time_constant_s is None or sensor.interval is None:
                continue
            y, low, high = row + 0.2 * place, *sensor.interval
            error = [[sensor.time_constant_s - low], [high - sensor.time_constant_s]]
            label = name if row == 0 else None
            ax.errorbar(sensor.time_constant_s, y, xerr=error, fmt="o", capsize=3, color=f"C{place}", label=label)
    ax.set_yticks([0.1, 1.1], list(answer.sensors))
    ax.set(xlabel="time constant (s)", xscale="log")
    if ax.get_legend_handles_labels()[0]:
        ax.legend()
    return ax
