"""Charts in the form that plotly.js draws; colours are names of CSS variables, which `figures.js` fills in."""

from __future__ import annotations

import base64
import math
from html import escape
from typing import Any

import numpy as np

from ...kernel.arrays import FloatArray
from ..content.chart import Axis, Chart, ChartForm, Figure, HeatMap, Role, Trace
from ..content.labels import ends, label_places

Json = dict[str, Any]

_MOST_DECADES = 3.0  # of an axis with ticks between powers of ten
_SINGLE = 1e-5  # rounding of single precision that does not show, share of the range
_LINES: dict[ChartForm, tuple[str, Json]] = {
    ChartForm.LINE: ("lines", {"width": 1.5}),
    ChartForm.DASHED: ("lines", {"width": 1.6, "dash": "dash"}),
    ChartForm.DOTTED: ("lines", {"width": 1.2, "dash": "dot"}),
    ChartForm.DOTS: ("markers", {}),
    ChartForm.MARKS: ("markers", {}),
    ChartForm.MARKED_LINE: ("lines+markers", {"width": 1.2}),
}
_FADED = "/0.18"  # opacity of a band
_ROOM = (46.0, 22.0)  # letters and lines of text that fit into a drawing, also on a phone


def figure_json(figure: Figure) -> Json:
    """One figure: its key, traces and layout."""
    return _heat_map(figure) if isinstance(figure, HeatMap) else _chart(figure)


def _chart(chart: Chart) -> Json:
    layout = {"xaxis": _axis(chart.x, chart), "yaxis": _axis(chart.y, chart)}
    if chart.is_drawing:
        layout["yaxis"]["scaleanchor"] = "x"
        for way in "xy":
            layout[f"{way}axis"]["range"] = list(ends(chart, way))
    traces = [_trace(trace, chart) for trace in chart.traces]
    for place, sides in label_places(chart, *_ROOM).items():
        trace = traces[place]
        trace["text"] = [text if side else "" for text, side in zip(trace["hovertext"], sides, strict=True)]
        trace |= {"textposition": [side or "middle right" for side in sides], "mode": "markers+text",
                  "textfont": {"color": trace["marker"]["color"], "size": 11}, "cliponaxis": False}  # fmt: skip
    return {"key": chart.key, "single": chart.single, "traces": traces, "layout": layout}


def _axis(axis: Axis, chart: Chart) -> Json:
    low, high = axis.limits
    form: Json = {"title": {"text": axis.label}}
    if axis.log:
        form |= {"type": "log", "dtick": 1, "minor": {"dtick": "D1", "showgrid": True}}
        if _decades(chart, axis) <= _MOST_DECADES:
            # A format makes plotly.js write 2 and 0.5, not small digits between powers.
            form |= {"tickformat": "~g", "dtick": "D2"}
    if axis.names:
        numbers = list(range(1, len(axis.names) + 1))
        form |= {"tickvals": numbers, "ticktext": [escape(name, quote=False) for name in axis.names], "tickangle": -90}
    elif axis.whole:
        last = max(float(trace.x.max()) for trace in chart.traces)
        form |= {"tick0": 1, "dtick": max(1, math.ceil(last / 8.0))}
    if low is not None and high is not None:
        form["range"] = [low, high]
    elif low is not None:
        form |= {"autorangeoptions": {"minallowed": low}, "rangemode": "tozero"}
    return form


def _decades(chart: Chart, axis: Axis) -> float:
    """Powers of ten that the traces span along a logarithmic axis."""
    values = np.concatenate([trace.x if axis is chart.x else trace.y for trace in chart.traces])
    shown = values[np.isfinite(values) & (values > 0.0)]
    return math.log10(float(shown.max()) / float(shown.min())) if shown.size else 0.0


def _trace(trace: Trace, chart: Chart) -> Json:
    colour = f"--{trace.role.value}"
    units = (f" {axis.unit.name}".rstrip() for axis in (chart.x, chart.y))
    hover = "%{{x:.6~g}}{}<br>%{{y:.5~g}}{}<extra>{}</extra>".format(*units, trace.name)
    form: Json = {
        "type": "scatter",
        "name": trace.name,
        "hovertemplate": hover,
        "meta": {
            "record": trace.record,
            "cycles": [list(cycle) for cycle in trace.cycles],
            "whole": trace.shown,
            "colour": trace.role.value,
            "form": trace.form.value.replace(" ", "-"),
        },
    }
    if trace.texts:
        texts = [escape(text, quote=False) for text in trace.texts]
        form |= {"hovertext": texts, "hovertemplate": f"%{{hovertext}}<br>{hover}"}
    if chart.is_drawing:
        form["hovertemplate"] = "%{hovertext}<extra></extra>" if trace.texts else f"{escape(trace.name)}<extra></extra>"
    if trace.form is ChartForm.BARS:
        ends = {"y": _values(trace.y)}
        if trace.low is not None:
            ends = {"base": _values(trace.low), "y": _values(trace.y - trace.low)}
        return form | {
            "type": "bar", "x": _values(trace.x), **ends, "width": trace.bar_width,
            "marker": {"color": colour + "/0.55", "line": {"width": 0}},
        }  # fmt: skip
    if trace.form is ChartForm.BAND and trace.low is not None:
        return form | {
            "x": _values(np.concatenate([trace.x, trace.x[::-1]])),
            "y": _values(np.concatenate([trace.y, trace.low[::-1]])),
            "mode": "lines", "line": {"width": 0, "color": colour}, "fill": "toself", "fillcolor": colour + _FADED,
            "hoverinfo": "skip", "hovertemplate": None,
        }  # fmt: skip
    if trace.form is ChartForm.RANGES and trace.low is not None:
        half = 0.5 * (trace.y - trace.low)
        return form | {
            "x": _values(trace.x), "y": _values(trace.low + half), "mode": "markers",
            "marker": {"color": colour, "size": 1}, "hovertemplate": None, "hoverinfo": "name",
            "error_y": {"array": _values(half), "color": colour, "thickness": 2, "width": 6},
        }  # fmt: skip
    mode, line = _LINES[trace.form]
    if trace.form is ChartForm.LINE and trace.role is Role.MEASURED:
        line = {"width": 2.6}  # seen on both sides of the model's line
    form |= {"x": _values(trace.x), "y": _values(trace.y), "mode": mode, "line": {"color": colour, **line}}
    if trace.form is ChartForm.DOTS:
        form["marker"] = {"color": colour, "size": 3, "opacity": 0.65}
    elif trace.form in (ChartForm.MARKS, ChartForm.MARKED_LINE):
        form["marker"] = {"color": colour, "size": 8 if trace.form is ChartForm.MARKS else 5}
    if trace.error is not None:
        form["error_y"] = {"array": _values(trace.error), "color": colour, "thickness": 1.4, "width": 5}
    return form


def _heat_map(figure: HeatMap) -> Json:
    labels = list(figure.labels)
    font = {"size": 8 if len(labels) > 16 else 11}
    axis: Json = {"type": "category", "showgrid": False, "dtick": 1, "tickfont": font}
    return {
        "key": figure.key,
        "single": False,
        "traces": [
            {
                "type": "heatmap", "x": labels, "y": labels, "z": np.round(figure.values, 3).tolist(),
                "zmin": -1, "zmax": 1, "colorscale": [[0, "--blue"], [0.5, "--paper"], [1, "--model"]],
                "hovertemplate": "%{y}, %{x}: %{z:.3f}<extra></extra>", "xgap": 1, "ygap": 1,
                "colorbar": {"thickness": 12, "outlinewidth": 0, "dtick": 0.5},
                "meta": {"record": None, "cycles": [], "whole": None, "colour": "", "form": ""},
            }
        ],
        "layout": {
            "xaxis": {**axis, "tickangle": -90}, "yaxis": {**axis, "autorange": "reversed"},
        },
    }  # fmt: skip


def _values(values: FloatArray) -> Json:
    """Numbers as base64, in single precision where its rounding does not show; `figures.js` reads them."""
    finite = values[np.isfinite(values)]
    largest, spread = (float(np.abs(finite).max()), float(np.ptp(finite))) if finite.size else (0.0, 0.0)
    single = largest < 1e30 and largest * 2.0**-24 <= _SINGLE * spread
    form = np.ascontiguousarray(values, dtype="<f4" if single else "<f8")
    return {"dtype": "f4" if single else "f8", "bdata": base64.b64encode(form.tobytes()).decode("ascii")}
