//! Plots, each as SVG and as PNG. The font is in a crate, and tiny-skia, which the library uses for pictures,
//! compresses PNGs: neither fonts nor libraries of the machine are needed.

use anyhow::{Context as _, Result, anyhow};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, register_font};
use serde::Serialize;
use std::path::Path;
use tiny_skia::{IntSize, Pixmap};

/// Width and height of a plot in pixels.
const SIZE: (u32, u32) = (960, 600);
/// Width of the legend on the right.
const LEGEND: i32 = 230;
/// Colours that people with common kinds of colour blindness can tell apart (Okabe and Ito); then greys.
const COLOURS: [RGBColor; 10] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(20, 20, 20),
    RGBColor(150, 150, 150),
    RGBColor(130, 60, 20),
    RGBColor(100, 80, 200),
];

/// One plot.
#[derive(Debug, Serialize)]
pub struct Chart {
    /// File name without folder and extension.
    pub file: String,
    /// Heading.
    pub title: String,
    /// Labels of the axes, with units.
    pub labels: [&'static str; 2],
    /// Whether x and y are logarithmic.
    pub logarithmic: [bool; 2],
    /// The curves of the plot.
    pub series: Vec<Series>,
}

/// Points of one colour.
#[derive(Debug, Serialize)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// x and y.
    pub points: Vec<[f64; 2]>,
}

/// Writes `folder/file.svg` and `folder/file.png`; nothing for a plot without points.
///
/// # Errors
/// If drawing or writing fails.
pub fn write(chart: &Chart, folder: &Path) -> Result<()> {
    let Some(axes) = Axes::of(chart) else { return Ok(()) };
    // Registering the same font twice is harmless, and no other is used.
    register_font("sans-serif", FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .map_err(|_| anyhow!("the built-in font cannot be read"))?;
    let path = |ending: &str| folder.join(format!("{}.{ending}", chart.file));
    let mut svg = String::new();
    draw(chart, &axes, &SVGBackend::with_string(&mut svg, SIZE).into_drawing_area())?;
    std::fs::write(path("svg"), svg).with_context(|| format!("writing {}", path("svg").display()))?;
    let mut rgb = vec![0; 3 * (SIZE.0 * SIZE.1) as usize];
    draw(chart, &axes, &BitMapBackend::with_buffer(&mut rgb, SIZE).into_drawing_area())?;
    let rgba: Vec<u8> = rgb.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect();
    let size = IntSize::from_wh(SIZE.0, SIZE.1);
    let pixels = size.and_then(|size| Pixmap::from_vec(rgba, size)).context("the size of plots")?;
    pixels.save_png(path("png")).with_context(|| format!("writing {}", path("png").display()))
}

/// One axis with its ends and ticks; these are logarithms if the axis is logarithmic.
#[derive(Clone)]
struct Axis {
    ends: [f64; 2],
    ticks: Vec<f64>,
    logarithmic: bool,
}

struct Axes {
    x: Axis,
    y: Axis,
}

impl Axes {
    fn of(chart: &Chart) -> Option<Self> {
        let axis = |c: usize| {
            let values = chart.series.iter().flat_map(|s| &s.points).map(move |p| p[c]);
            Axis::over(values, chart.logarithmic[c])
        };
        Some(Self { x: axis(0)?, y: axis(1)? })
    }
}

impl Axis {
    /// An axis that covers all values; `None` if there are none.
    fn over(values: impl Iterator<Item = f64>, logarithmic: bool) -> Option<Self> {
        let (low, high) = values
            .map(|v| if logarithmic { v.log10() } else { v })
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            return None;
        }
        let least = if logarithmic { 0.3 } else { 1e-3 * high.abs().max(1e-6) };
        let margin = (0.06 * (high - low)).max(least);
        let ends = [low - margin, high + margin];
        Some(Self { ends, ticks: ticks(ends, logarithmic), logarithmic })
    }

    fn place(&self, value: f64) -> f64 {
        if self.logarithmic { value.log10() } else { value }
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        let share = (value - self.ends[0]) / (self.ends[1] - self.ends[0]);
        first + (share * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.ends[0]..self.ends[1]
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, place: &f64) -> String {
        if !self.logarithmic {
            let step = self.ticks.windows(2).next().map_or(1.0, |pair| pair[1] - pair[0]);
            let decimals = (-(step * 1.001).log10().floor()).clamp(0.0, 6.0) as usize;
            return format!("{place:.decimals$}");
        }
        let value = 10f64.powf(*place);
        match value {
            v if v >= 0.9995e6 => format!("{:.0}M", v * 1e-6),
            v if v >= 0.9995e3 => format!("{:.0}K", v * 1e-3),
            v => format!("{v:.*}", (-v.log10().floor()).clamp(0.0, 6.0) as usize),
        }
    }
}

/// Round numbers between the ends, four to ten if possible.
fn ticks([low, high]: [f64; 2], logarithmic: bool) -> Vec<f64> {
    if logarithmic {
        let decades = (low.floor() as i32)..=(high.ceil() as i32);
        let digits: &[f64] = if high - low > 3.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let all = decades.flat_map(|d| digits.iter().map(move |m| f64::from(d) + m.log10()));
        return all.filter(|t| (low..=high).contains(t)).collect();
    }
    let rough = (high - low) / 8.0;
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade).into_iter().find(|s| *s >= rough).unwrap_or(rough);
    let first = (low / step).ceil() as i64;
    (first..=(high / step).floor() as i64).map(|k| k as f64 * step).collect()
}

fn draw<D: DrawingBackend>(chart: &Chart, axes: &Axes, area: &DrawingArea<D, Shift>) -> Result<()>
where
    D::ErrorType: 'static,
{
    let failed = |error: DrawingAreaErrorKind<D::ErrorType>| anyhow!("drawing {}: {error}", chart.file);
    area.fill(&WHITE).map_err(failed)?;
    let mut plot = ChartBuilder::on(area)
        .caption(&chart.title, ("sans-serif", 22))
        .margin(12)
        .margin_right(LEGEND)
        .x_label_area_size(48)
        .y_label_area_size(72)
        .build_cartesian_2d(axes.x.clone(), axes.y.clone())
        .map_err(failed)?;
    plot.configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(225, 225, 225))
        .label_style(("sans-serif", 15))
        .axis_desc_style(("sans-serif", 17))
        .x_desc(chart.labels[0])
        .y_desc(chart.labels[1])
        .draw()
        .map_err(failed)?;
    for (number, series) in chart.series.iter().enumerate() {
        let colour = COLOURS[number % COLOURS.len()];
        let points: Vec<(f64, f64)> = series
            .points
            .iter()
            .map(|p| (axes.x.place(p[0]), axes.y.place(p[1])))
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .collect();
        plot.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2))).map_err(failed)?;
        // Hollow points distinguish series beyond the number of colours.
        let filled = number < COLOURS.len();
        let style = if filled { colour.filled() } else { colour.stroke_width(2) };
        plot.draw_series(points.iter().map(|p| Circle::new(*p, 5, style))).map_err(failed)?;
        let left = SIZE.0 as i32 - LEGEND + 20;
        let top = 60 + 24 * number as i32;
        area.draw(&Circle::new((left, top), 5, style)).map_err(failed)?;
        let middle = Pos::new(HPos::Left, VPos::Center);
        let font = ("sans-serif", 17).into_text_style(area).pos(middle);
        let text = Text::new(series.name.clone(), (left + 14, top), font);
        area.draw(&text).map_err(failed)?;
    }
    area.present().map_err(failed)
}
