//! `rtfmesh presets`: the methods to compare with, and their settings.

use super::all_at_once::{Preset, SETTINGS, SettingArgs};
use super::terminal::print;
use crate::grammar::counted;
use anyhow::Result;
use clap::{Args as _, Command, ValueEnum};
use rtfmesh::{Options, Quality};

const EXAMPLES: &str = "Examples:
  rtfmesh presets
  rtfmesh presets rtf";

/// Describe the presets (the method of a paper and those it compares with) and their settings.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Preset to describe; without it, all are listed
    #[arg(value_enum)]
    name: Option<Preset>,
}

/// Lists the presets, or prints the page of one.
pub fn run(args: &Args) -> Result<()> {
    match args.name {
        Some(preset) => print(&page(preset)?),
        None => print(&list()),
    }
}

fn list() -> String {
    let value = |preset: &Preset| preset.to_possible_value();
    let row = |value: clap::builder::PossibleValue| {
        format!("{:9}{}\n", value.get_name(), value.get_help().map(ToString::to_string).unwrap_or_default())
    };
    let rows: String = Preset::value_variants().iter().filter_map(value).map(row).collect();
    format!(
        "{rows}\nThe paper is \"Accelerating surface remeshing through GPU-based computation of the \
         restricted tangent face\".\n`rtfmesh presets NAME` describes a preset; `rtfmesh remesh --preset \
         NAME` uses it.\n"
    )
}

/// What all presets but the default one have in common.
const COMMON: &str = "All vertices exist from the start. There are no features, no polish and no fit; the \
    result is checked as that of the default preset is, but neither local operations nor further vertices \
    follow.";

fn about(preset: Preset) -> &'static str {
    match preset {
        Preset::Default => {
            "Few vertices first, then a new one at the middle of every edge until there are N; then polish \
             and fit. It has none of the settings of the other presets; `rtfmesh remesh --help` lists its \
             options."
        }
        Preset::Rtf => {
            "The method of the paper. A vertex moves to the mean of the corners of its restricted tangent \
             face, a polygon in its tangent plane. The time is quadratic in the number of vertices."
        }
        Preset::Rpf => {
            "As rtf, but cells are clipped also by shadow sites on both sides of the surface (restricted \
             power faces). The time is quadratic in the number of vertices."
        }
        Preset::Rvc => {
            "As rtf, but the input is treated as a point cloud: tangent planes are fitted to its vertices, \
             and vertices are projected onto these planes. The time is quadratic in the number of vertices."
        }
        Preset::Rvd => {
            "A vertex moves to the centroid of its exact cell on the surface (restricted Voronoi diagram, \
             Lloyd's iteration); --lbfgs minimizes the same energy in fewer iterations."
        }
        Preset::Cvd => "As rvd, with momentum (centroidal Voronoi diagram), which takes fewer iterations.",
        Preset::Mps => "Random points with a minimum distance and no gaps, connected without iterations.",
    }
}

/// What a preset is, and its settings with their defaults.
fn page(preset: Preset) -> Result<String> {
    let name = preset.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default();
    let options = preset.options(4, Quality::Normal);
    let command = Command::new("presets").disable_help_flag(true);
    let mut command = if preset == Preset::Default {
        command.about(format!("{name}: {}", about(preset))).help_template("{about}")
    } else {
        let all = format!("{name}: {}\n\n{COMMON} {}", about(preset), iterations(&options));
        let template =
            format!("{{about}}\n\nSettings (options of `rtfmesh remesh --preset {name}`):\n{{options}}");
        settings(command, &options)?.about(all).help_template(template)
    };
    let text = command.render_long_help().to_string();
    Ok(text.trim_end().to_owned() + "\n")
}

fn iterations(options: &Options) -> String {
    match options.iterations {
        0 => "It has no iterations.".to_owned(),
        most => format!("It has at most {} (--iterations).", counted(most, ["iteration", "iterations"])),
    }
}

/// The settings that do anything with these options, with their defaults there.
fn settings(command: Command, options: &Options) -> Result<Command> {
    let defaults = serde_json::to_value(&options.all_at_once)?;
    let with_default = |command: Command, (name, needs): (&'static str, super::all_at_once::Needs)| {
        let default = match &defaults[name] {
            serde_json::Value::String(word) => word.clone(),
            number => number.as_f64().unwrap_or_default().to_string(),
        };
        command.mut_arg(name, |arg| {
            let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
            arg.hide(!needs.are_met(options)).help(format!("{help} [default: {default}]"))
        })
    };
    Ok(SETTINGS.into_iter().fold(SettingArgs::augment_args(command), with_default))
}
