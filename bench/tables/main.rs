//! The paper's tables and figures, and other programs, on the same machine in one run. See bench/README.md.

mod contest;
mod contestant;
mod date;
mod fig10;
mod fig12;
mod fig14;
mod fig7;
mod fig8;
mod many;
mod markdown;
mod models;
mod paper;
mod parts;
mod peers;
mod plots;
mod preset;
mod process;
mod published;
mod results;
mod row;
mod runs;
mod search;
mod section;

use anyhow::{Context as _, Result, ensure};
use clap::{Parser, ValueEnum};
use models::Models;
use preset::Preset;
use results::Report;
use rtfmesh::{Device, DeviceOptions};
use runs::Bench;
use section::Section;
use std::path::PathBuf;
use std::time::Instant;

/// Makes the paper's tables and figures again.
#[derive(Parser)]
struct Args {
    /// What to make; everything if nothing is named
    #[arg(value_enum)]
    parts: Vec<Part>,
    /// Folder with the models as mesh files, such as kitten.ply; without it built-in models stand in
    #[arg(long, value_name = "DIR")]
    meshes: Option<PathBuf>,
    /// A tenth of the sizes, 60 iterations at most, fewer models and methods
    #[arg(long)]
    quick: bool,
    /// Folder for tables.json, tables.md and plots
    #[arg(long, value_name = "DIR", default_value = "out/tables")]
    out: PathBuf,
    /// Device: an index, `cpu`, `gpu` or a part of the name
    #[arg(long)]
    device: Option<String>,
    /// Most runs that a time is the median of
    #[arg(long, default_value_t = 3)]
    runs: usize,
    /// Most vertices of Fig. 8
    #[arg(long, default_value_t = 100_000)]
    largest: usize,
    /// Methods of Tables 1 and 2 and of Fig. 12 [default: all, in Table 1 without rpf and rvc; with --quick
    /// mps, rtf, default]
    #[arg(long, value_enum, value_delimiter = ',')]
    methods: Vec<Preset>,
    /// Whether other programs are run, if nothing is named
    #[arg(long, value_enum, default_value_t = Switch::On)]
    peers: Switch,
    /// Passed by `cargo bench`; has no effect
    #[arg(long, hide = true)]
    bench: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Switch {
    On,
    Off,
}

/// In the order of the run: those whose results others use come first.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Table 1
    Table1,
    /// Table 2
    Table2,
    /// Irregular vertices
    Fig7,
    /// Time and quality against size: Figs. 8 and 9
    Fig8,
    /// Lengths of neighbour lists
    Fig10,
    /// One iteration of every method
    Fig12,
    /// Limits of the paper's method
    Fig14,
    /// Many small meshes on one device
    Many,
    /// Time against the number of parts
    Parts,
    /// Other programs
    Peers,
    /// Other programs on CAD parts
    Cad,
}

impl Part {
    fn make(self, bench: &mut Bench, device: Option<&str>) -> Result<Section> {
        match self {
            Self::Table1 => published::table1(bench),
            Self::Table2 => published::table2(bench),
            Self::Fig7 => fig7::section(bench),
            Self::Fig8 => fig8::section(bench),
            Self::Fig10 => fig10::section(bench),
            Self::Fig12 => fig12::section(bench),
            Self::Fig14 => fig14::section(bench),
            Self::Many => many::section(bench),
            Self::Parts => parts::section(bench),
            Self::Peers => peers::section(bench, device),
            Self::Cad => peers::cad(bench, device),
        }
    }
}

fn main() -> Result<()> {
    let begin = Instant::now();
    let args = Args::parse();
    ensure!(args.runs > 0, "--runs must be at least 1");
    std::fs::create_dir_all(&args.out).with_context(|| format!("--out {}", args.out.display()))?;
    let mut options = DeviceOptions::from_env();
    options.device = args.device.clone().or(options.device);
    let device = Device::open(&options)?;
    let timing = Device::open(&options.clone().timings(true))?;
    let mut report = Report::new(device.info(), args.quick, args.runs);
    let mut bench =
        Bench::new([device, timing], Models::new(args.meshes.clone())?, presets(&args), args.runs)?;
    bench.quick = args.quick;
    bench.named = !args.methods.is_empty();
    bench.largest = args.largest;
    for part in parts(&args) {
        let started = begin.elapsed();
        let section = part.make(&mut bench, options.device.as_deref())?;
        println!("\n{}", section.to_markdown());
        let now = begin.elapsed();
        println!("{}: {:.0} s\n", section.name, (now - started).as_secs_f64());
        report.add(section, now.as_secs_f64() / 60.0, &args.out)?;
    }
    println!("All in {:.1} minutes, in {}", begin.elapsed().as_secs_f64() / 60.0, args.out.display());
    Ok(())
}

/// In the order of [`Part`], each once.
fn parts(args: &Args) -> Vec<Part> {
    let all = Part::value_variants().iter().copied();
    if args.parts.is_empty() {
        let others = |part: &Part| matches!(part, Part::Peers | Part::Cad);
        return all.filter(|part| !others(part) || args.peers == Switch::On).collect();
    }
    all.filter(|part| args.parts.contains(part)).collect()
}

/// In the order of [`Preset::ALL`].
fn presets(args: &Args) -> Vec<Preset> {
    let quick: &[Preset] = &[Preset::Mps, Preset::Rtf, Preset::Default];
    let chosen = match (args.methods.as_slice(), args.quick) {
        ([], true) => quick,
        ([], false) => &Preset::ALL,
        (named, _) => named,
    };
    Preset::ALL.into_iter().filter(|preset| chosen.contains(preset)).collect()
}
