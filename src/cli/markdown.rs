//! All commands and options in Markdown, made from their declarations.

use super::all_at_once::SettingArgs;
use clap::{Arg, Args, Command};

/// Columns of the text.
const WIDTH: usize = 110;
const HEAD: &str = "# Commands and options\n\nGenerated from the declarations that `--help` shows, by\n\
    `cargo run -- man --markdown > docs/options.md`.\n";

/// The page of a program whose commands have their full names, see [`Command::build`].
pub fn page(program: &Command) -> String {
    let mut page = HEAD.to_owned();
    for command in program.get_subcommands() {
        page += &section(command);
    }
    page += "\n## Files, exit codes, environment\n";
    let notes = program.get_after_long_help().map(ToString::to_string);
    for line in notes.unwrap_or_default().lines() {
        page += &format!("\n{}", wrap(line, "", ""));
    }
    page
}

fn section(command: &Command) -> String {
    let mut text = format!("\n## {}\n\n", command.get_bin_name().unwrap_or_else(|| command.get_name()));
    let about = command.get_long_about().or(command.get_about()).map(ToString::to_string);
    for paragraph in about.unwrap_or_default().split("\n\n") {
        text += &format!("{}\n", wrap(&with_period(paragraph), "", ""));
    }
    let usage = command.clone().render_usage().to_string();
    text += &format!("    {}\n\n", usage.trim_start_matches("Usage: ").trim_end());
    text.extend(command.get_positionals().map(item));
    let is_listed = |arg: &&Arg| !arg.is_positional() && !arg.is_hide_set() && arg.get_id() != "help";
    let options = || command.get_arguments().filter(is_listed);
    let mut headings: Vec<Option<&str>> = Vec::new();
    for heading in options().map(Arg::get_help_heading) {
        if !headings.contains(&heading) {
            headings.push(heading);
        }
    }
    for heading in headings {
        text += &format!("\n### {}\n\n", heading.unwrap_or("Options"));
        text.extend(options().filter(|arg| arg.get_help_heading() == heading).map(item));
    }
    if command.get_name() == "presets" {
        text += "\n### Settings of presets\n\nOptions of `rtfmesh remesh` and `rtfmesh batch` with presets \
            other than default; presets.md has their\ndefaults.\n\n";
        let settings = SettingArgs::augment_args(Command::new("settings"));
        text.extend(settings.get_arguments().map(item));
    }
    text
}

/// An argument with its help, its default and its values.
fn item(arg: &Arg) -> String {
    let help = arg.get_long_help().or(arg.get_help()).map(ToString::to_string).unwrap_or_default();
    let mut text = format!("{}: {}", name(arg), with_period(&help.replace("\n\n", ". ")));
    let default: Vec<_> = arg.get_default_values().iter().filter_map(|value| value.to_str()).collect();
    if !default.is_empty() && arg.get_action().takes_values() {
        text += &format!(" Default: {}.", default.join(" "));
    }
    let mut text = wrap(&text, "- ", "  ");
    for value in arg.get_possible_values() {
        let help = value.get_help().map(ToString::to_string);
        let line = help.map_or_else(String::new, |help| format!(": {}", with_period(&help)));
        text += &wrap(&format!("`{}`{line}", value.get_name()), "  - ", "    ");
    }
    text
}

/// Such as `-n`, `--vertices <N>`.
fn name(arg: &Arg) -> String {
    let needs_none = arg.get_num_args().is_some_and(|range| range.min_values() == 0);
    let is_optional = needs_none && arg.get_action().takes_values();
    let value = match arg.get_value_names() {
        Some([name, ..]) if is_optional => format!("[={name}]"),
        Some([name, ..]) if arg.get_action().takes_values() => format!(" <{name}>"),
        _ => String::new(),
    };
    let Some(long) = arg.get_long() else { return format!("`{}`", value.trim_start()) };
    let short = arg.get_short().map(|short| format!("`-{short}`, ")).unwrap_or_default();
    format!("{short}`--{long}{value}`")
}

/// Clap takes the last period away.
fn with_period(text: &str) -> String {
    if text.ends_with(['.', ']']) { text.to_owned() } else { format!("{text}.") }
}

/// Words in lines of at most [`WIDTH`] columns.
fn wrap(text: &str, first: &str, next: &str) -> String {
    let mut lines = String::new();
    let mut line = first.to_owned();
    let mut is_empty = true;
    for word in text.split_whitespace() {
        if !is_empty && line.chars().count() + 1 + word.chars().count() > WIDTH {
            lines += &format!("{line}\n");
            line = next.to_owned();
            is_empty = true;
        }
        if !is_empty {
            line.push(' ');
        }
        line += word;
        is_empty = false;
    }
    lines + &line + "\n"
}
