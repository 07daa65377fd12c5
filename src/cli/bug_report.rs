//! `rtfmesh bug-report`.

use super::demo::{MODEL, VERTICES, remesh_model};
use super::method::DeviceArgs;
use super::terminal::print;
use super::words;
use crate::error::escaped;
use anyhow::Result;
use rtfmesh::device::{Limits, SelfTest as Verdict, tested_devices};
use rtfmesh::report::to_json;
use rtfmesh::{DeviceInfo, list_devices};
use serde::Serialize;
use std::any::TypeId;
use std::collections::BTreeMap;
use std::env;
use std::ffi::OsString;
use std::fs::read_to_string;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "Examples:
  rtfmesh bug-report
  rtfmesh bug-report remesh part.ply out.ply -n 5k --feature-angle 30
  rtfmesh bug-report --json --no-self-test";

/// Print what a report of a bug should contain: version, system, devices, a test of the device.
///
/// Names of files and users are left out. Nothing is sent anywhere.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Command that went wrong, with its options; it is only printed
    #[arg(trailing_var_arg = true)]
    command: Vec<OsString>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Do not remesh a built-in model as a test of the device
    #[arg(long)]
    no_self_test: bool,
    #[command(flatten)]
    device: DeviceArgs,
}

/// The whole report.
#[derive(Serialize)]
struct BugReport {
    program: &'static str,
    version: &'static str,
    target: String,
    system: String,
    threads: Option<usize>,
    memory_bytes: Option<u64>,
    environment: BTreeMap<String, String>,
    command: Option<String>,
    devices: Vec<ListedDevice>,
    devices_error: Option<String>,
    self_test: Option<SelfTest>,
}

/// A device without the numbers that tell it from all others in the world.
#[derive(Serialize)]
struct ListedDevice {
    index: usize,
    name: String,
    kind: &'static str,
    driver: String,
    api: String,
    limits: Limits,
    missing: Vec<String>,
    self_test: Verdict,
}

/// What came of remeshing a built-in model.
#[derive(Serialize)]
struct SelfTest {
    model: &'static str,
    vertices: usize,
    device: Option<String>,
    mean_quality: Option<f64>,
    min_angle: Option<f64>,
    milliseconds: Option<f64>,
    warnings: Vec<String>,
    error: Option<String>,
}

/// Collects and prints. What goes wrong with devices is part of the report.
pub fn run(args: &Args, program: &clap::Command) -> Result<()> {
    let (devices, devices_error) = match list_devices() {
        Ok(list) => (list.into_iter().map(ListedDevice::from).collect(), None),
        Err(error) => (Vec::new(), Some(told(error))),
    };
    let mut report = BugReport {
        program: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        target: target(),
        system: system(),
        threads: std::thread::available_parallelism().ok().map(usize::from),
        memory_bytes: memory_bytes(),
        environment: environment(env::vars_os()),
        command: (!args.command.is_empty()).then(|| without_names(&args.command, program)),
        devices,
        devices_error,
        self_test: None,
    };
    // A driver may end the process, so everything else is printed first.
    if !args.json {
        report.rows().iter().try_for_each(|(name, value)| print(&row(name, value)))?;
    }
    if !args.no_self_test {
        report.test_drivers();
        if !args.json {
            report.driver_rows().iter().try_for_each(|(name, value)| print(&row(name, value)))?;
        }
        report.self_test = Some(self_test(&args.device));
    }
    match &report.self_test {
        _ if args.json => print(&to_json(&report)?),
        Some(test) => print(&row("self-test", &test.text())),
        None => report.driver_rows().iter().try_for_each(|(name, value)| print(&row(name, value))),
    }
}

fn row(name: &str, value: &str) -> String {
    format!("{name:13}{value}\n")
}

impl BugReport {
    fn rows(&self) -> Vec<(&'static str, String)> {
        let mut rows = vec![
            (self.program, self.version.to_owned()),
            ("target", self.target.clone()),
            ("system", self.system.clone()),
        ];
        rows.extend(self.threads.map(|threads| ("threads", threads.to_string())));
        rows.extend(self.memory_bytes.map(|bytes| ("memory", gibibytes(bytes))));
        rows.extend(self.environment.iter().map(|(name, value)| ("environment", format!("{name}={value}"))));
        rows.extend(self.command.clone().map(|command| ("command", command)));
        for device in &self.devices {
            rows.push(("device", device.text()));
            rows.push(("limits", limits(&device.limits)));
        }
        rows.extend(self.devices_error.clone().map(|error| ("devices", error)));
        rows
    }

    /// Runs the self-test of the drivers that were never used.
    fn test_drivers(&mut self) {
        for tested in tested_devices().unwrap_or_default() {
            if let Some(device) = self.devices.iter_mut().find(|device| device.index == tested.index) {
                device.self_test = tested.self_test;
            }
        }
    }

    fn driver_rows(&self) -> Vec<(&'static str, String)> {
        let usable = self.devices.iter().filter(|device| device.missing.is_empty());
        usable.map(|device| ("driver", format!("{}: self-test {}", device.index, device.self_test))).collect()
    }
}

impl From<DeviceInfo> for ListedDevice {
    fn from(info: DeviceInfo) -> Self {
        let DeviceInfo { index, name, kind, driver, api, limits, missing, self_test, .. } = info;
        Self { index, name, kind, driver: driver.trim().to_owned(), api, limits, missing, self_test }
    }
}

impl ListedDevice {
    fn text(&self) -> String {
        let Self { index, name, kind, driver, api, missing, .. } = self;
        let text = format!("{index}: {name}, {kind}, driver {driver}, Vulkan {api}");
        if missing.is_empty() { text } else { format!("{text}, needs {}", missing.join(", ")) }
    }
}

fn limits(l: &Limits) -> String {
    let timestamps = if l.timestamp_ns > 0.0 { "timestamps" } else { "no timestamps" };
    format!(
        "{} MiB per buffer, {} KiB shared memory, {} buffers per kernel, {} invocations per workgroup, \
         subgroups of {}, {} memory, {timestamps}",
        l.storage_buffer_bytes >> 20,
        l.shared_memory_bytes >> 10,
        l.storage_buffers,
        l.workgroup_invocations,
        l.subgroup_size,
        gibibytes(l.memory_bytes),
    )
}

fn gibibytes(bytes: u64) -> String {
    format!("{:.1} GiB", bytes as f64 / f64::from(1 << 30))
}

fn self_test(args: &DeviceArgs) -> SelfTest {
    let mut test = SelfTest {
        model: MODEL,
        vertices: VERTICES,
        device: None,
        mean_quality: None,
        min_angle: None,
        milliseconds: None,
        warnings: Vec::new(),
        error: None,
    };
    let outcome = args.open(false).and_then(|device| {
        test.device = Some(device.info().name.clone());
        remesh_model(&device)
    });
    match outcome {
        Ok(demo) => {
            let summary = demo.result.summary;
            test.mean_quality = Some(summary.output.quality.mean_quality);
            test.min_angle = Some(summary.output.quality.min_angle);
            test.milliseconds = Some(summary.timings.wall_milliseconds);
            test.warnings = summary.warnings;
        }
        Err(error) => test.error = Some(told(error)),
    }
    test
}

impl SelfTest {
    fn text(&self) -> String {
        let device = self.device.as_ref().map(|name| format!(" on {name}")).unwrap_or_default();
        let what = format!("{} with {} vertices{device}: ", self.model, self.vertices);
        if let Some(error) = &self.error {
            return what + "failed: " + error;
        }
        let [quality, angle, time] =
            [self.mean_quality, self.min_angle, self.milliseconds].map(Option::unwrap_or_default);
        let figures =
            format!("mean quality {quality:.6}, smallest angle {angle:.4}°, {:.2} s", time / 1000.0);
        let warnings = self.warnings.iter().map(|text| format!("; warning: {text}"));
        what + &figures + &warnings.collect::<String>()
    }
}

/// An error without the user's folder, which may be in the names of drivers.
fn told(error: rtfmesh::Error) -> String {
    let text = words::line(&error.into());
    without_folder(&text, dirs::home_dir().as_deref())
}

fn without_folder(text: &str, home: Option<&Path>) -> String {
    let home = home.and_then(Path::to_str).filter(|home| home.len() > 1);
    home.map_or_else(|| text.to_owned(), |home| text.replace(home, "~"))
}

/// Such as `x86_64-linux-gnu`.
fn target() -> String {
    let library = [
        (cfg!(target_env = "gnu"), "-gnu"),
        (cfg!(target_env = "musl"), "-musl"),
        (cfg!(target_env = "msvc"), "-msvc"),
    ];
    let library = library.iter().find(|(is_it, _)| *is_it).map_or("", |(_, name)| name);
    format!("{}-{}{library}", env::consts::ARCH, env::consts::OS)
}

/// The system's name and version, as far as files tell.
fn system() -> String {
    let of_linux = || {
        let names = read_to_string("/etc/os-release").ok()?;
        let name = names.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="))?;
        let kernel = read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
        Some(escaped(format!("{}, kernel {}", name.trim_matches('"'), kernel.trim()).trim()))
    };
    let of_mac = || {
        let list = read_to_string("/System/Library/CoreServices/SystemVersion.plist").ok()?;
        let (_, rest) = list.split_once("<key>ProductVersion</key>")?;
        let (_, rest) = rest.split_once("<string>")?;
        Some(escaped(&format!("macOS {}", rest.split_once("</string>")?.0)))
    };
    of_linux().or_else(of_mac).unwrap_or_else(|| env::consts::OS.to_owned())
}

fn memory_bytes() -> Option<u64> {
    let text = read_to_string("/proc/meminfo").ok()?;
    let total = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    total.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// Variables of other programs that change what rtfmesh does.
const FOREIGN: [&str; 8] = [
    "CUDA_VISIBLE_DEVICES",
    "RAYON_NUM_THREADS",
    "VK_ADD_DRIVER_FILES",
    "VK_DRIVER_FILES",
    "VK_ICD_FILENAMES",
    "VK_INSTANCE_LAYERS",
    "VK_LOADER_DRIVERS_DISABLE",
    "VK_LOADER_DRIVERS_SELECT",
];
/// Variables whose values are names of folders or programs even if they look like words.
const PATHS: [&str; 2] = ["RTFMESH_BROWSER", "RTFMESH_CACHE_DIR"];

/// The variables that matter. Of a path only the name of a driver's manifest is shown.
fn environment(all: impl Iterator<Item = (OsString, OsString)>) -> BTreeMap<String, String> {
    let shown = |value: &Path, is_path: bool| {
        let is_manifest = value.extension().is_some_and(|extension| extension == "json");
        let name = value.file_name().filter(|_| is_manifest);
        match name {
            Some(name) => escaped(&name.to_string_lossy()),
            None if is_path || has_folder(&value.to_string_lossy()) => "PATH".to_owned(),
            None => escaped(&value.to_string_lossy()),
        }
    };
    let mut found = BTreeMap::new();
    for (name, value) in all {
        let Some(name) = name.to_str() else { continue };
        if name.starts_with("RTFMESH_") || FOREIGN.contains(&name) {
            let is_path = PATHS.contains(&name);
            let parts: Vec<String> = env::split_paths(&value).map(|part| shown(&part, is_path)).collect();
            found.insert(name.to_owned(), parts.join(", "));
        }
    }
    found
}

/// Whether a word may name a folder. Fractions such as those of `--shard` do not.
fn has_folder(word: &str) -> bool {
    word.contains('\\') || word.contains('/') && word.contains(char::is_alphabetic)
}

/// A command with `FILE` and its extension in place of names of files.
fn without_names(words: &[OsString], program: &clap::Command) -> String {
    let words: Vec<_> = words.iter().map(|word| word.to_string_lossy()).collect();
    let named = words.first().and_then(|first| program.find_subcommand(first.as_ref()));
    let Some(command) = named.or_else(|| program.find_subcommand("remesh")) else { return String::new() };
    let mut shown: Vec<String> = named.map(|command| command.get_name().to_owned()).into_iter().collect();
    let mut positionals = 0;
    let mut awaited = None;
    for word in words.iter().skip(shown.len()) {
        if let Some(option) = awaited.take() {
            shown.push(value_without_names(Some(option), word));
        } else if word.len() > 1 && word.starts_with('-') {
            let (name, value) = split_option(word);
            let option = command.get_arguments().find(|option| is_named(option, name));
            // A name that no option has may be anything.
            let name = if option.is_some() { name } else { "--OPTION" };
            shown.push(value.map_or_else(
                || name.to_owned(),
                |value| format!("{name}={}", value_without_names(option, value)),
            ));
            awaited = option.filter(|option| {
                value.is_none() && option.get_action().takes_values() && !option.is_require_equals_set()
            });
        } else {
            // The last one takes all that are left.
            let last = command.get_positionals().count().saturating_sub(1);
            shown.push(value_without_names(command.get_positionals().nth(positionals.min(last)), word));
            positionals += 1;
        }
    }
    shown.join(" ")
}

/// An option as written, and the value in the same word.
fn split_option(word: &str) -> (&str, Option<&str>) {
    if word.starts_with("--") {
        return word.split_once('=').map_or((word, None), |(name, value)| (name, Some(value)));
    }
    // `-n5k`
    let end = word.char_indices().nth(2).map_or(word.len(), |(end, _)| end);
    let (name, value) = word.split_at(end);
    (name, (!value.is_empty()).then(|| value.strip_prefix('=').unwrap_or(value)))
}

fn is_named(option: &clap::Arg, name: &str) -> bool {
    match name.strip_prefix("--") {
        Some(long) => option.get_long() == Some(long),
        None => option.get_short().is_some_and(|short| name.chars().eq(['-', short])),
    }
}

fn value_without_names(arg: Option<&clap::Arg>, value: &str) -> String {
    let is_file = arg.is_none_or(|arg| arg.get_value_parser().type_id() == TypeId::of::<PathBuf>());
    if !is_file && !has_folder(value) {
        return escaped(value);
    }
    if value == "-" {
        return value.to_owned();
    }
    let extension = |path: &Path| {
        let text = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        let is_short = (1..=5).contains(&text.len());
        if is_short && text.bytes().all(|byte| byte.is_ascii_alphanumeric()) {
            format!(".{text}")
        } else {
            String::new()
        }
    };
    let path = Path::new(value);
    match extension(path) {
        packed if packed == ".gz" => format!("FILE{}.gz", extension(&path.with_extension(""))),
        plain => format!("FILE{plain}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn shown(line: &str) -> String {
        let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        without_names(&words, &super::super::Cli::command())
    }

    #[test]
    fn commands_are_shown_without_names() {
        for (line, wanted) in [
            ("remesh ada/scan.ply out.ply -n 5k", "remesh FILE.ply FILE.ply -n 5k"),
            ("scan.ply.gz - -n5k -q", "FILE.ply.gz - -n=5k -q"),
            ("remesh ada - --report=/home/ada/r.json", "remesh FILE - --report=FILE.json"),
            (
                "remesh a b --features ada --weld 1e-4 --keep-uv",
                "remesh FILE FILE --features FILE --weld 1e-4 --keep-uv",
            ),
            ("remesh a b --keep label:C:\\ada", "remesh FILE FILE --keep FILE"),
            ("batch ada lovelace --out x --shard 1/4", "batch FILE FILE --out FILE --shard 1/4"),
            ("measure a.ada-1815 --ada=ada --lovelace", "measure FILE --OPTION=FILE --OPTION"),
            ("sample genus3 ada.obj", "sample genus3 FILE.obj"),
        ] {
            assert_eq!(shown(line), wanted, "{line}");
        }
    }

    #[test]
    fn the_environment_is_shown_without_folders() {
        let manifests = env::join_paths(["/home/ada/lvp_icd.x86_64.json", "/home/ada/drivers"]).unwrap();
        let all = [
            ("HOME", OsString::from("/home/ada")),
            ("RTFMESH_DEVICE", OsString::from("cpu")),
            ("RTFMESH_CACHE_DIR", OsString::from("ada")),
            ("VK_DRIVER_FILES", manifests),
        ];
        let found = environment(all.into_iter().map(|(name, value)| (name.into(), value)));
        let lines: Vec<String> = found.iter().map(|(name, value)| format!("{name}={value}")).collect();
        let wanted =
            ["RTFMESH_CACHE_DIR=PATH", "RTFMESH_DEVICE=cpu", "VK_DRIVER_FILES=lvp_icd.x86_64.json, PATH"];
        assert_eq!(lines, wanted);
    }

    #[test]
    fn errors_are_told_without_the_folder_of_the_user() {
        let text = "/home/ada/.local/icd.json: no driver";
        assert_eq!(without_folder(text, Some(Path::new("/home/ada"))), "~/.local/icd.json: no driver");
        assert_eq!(without_folder(text, Some(Path::new("/"))), text);
        assert_eq!(without_folder(text, None), text);
    }
}
