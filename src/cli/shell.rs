//! `rtfmesh completions` and `rtfmesh man`: what shells and `man` are told, made from the declarations of the
//! commands.

use super::markdown;
use super::terminal::print;
use anyhow::Result;
use clap_complete::Shell;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};
use rtfmesh::Error;
use rtfmesh::io;
use std::path::PathBuf;

const COMPLETIONS: &str = "Examples:
  rtfmesh completions bash > ~/.local/share/bash-completion/completions/rtfmesh
  rtfmesh completions zsh > ~/.zfunc/_rtfmesh
  rtfmesh completions fish > ~/.config/fish/completions/rtfmesh.fish";

/// Print a completion script for a shell.
#[derive(clap::Args)]
#[command(after_help = COMPLETIONS)]
pub struct CompletionsArgs {
    /// Shell to complete commands in
    #[arg(value_enum)]
    shell: Shell,
}

const MAN: &str = "Examples:
  rtfmesh man ~/.local/share/man/man1
  rtfmesh man | man -l -";

/// Write the manual, a page for each command; without a folder, print the main page.
#[derive(clap::Args)]
#[command(after_help = MAN)]
pub struct ManArgs {
    /// Folder for the pages, created if missing
    dir: Option<PathBuf>,
    /// Print all commands and options in Markdown, as in docs/options.md
    #[arg(long, conflicts_with = "dir")]
    markdown: bool,
}

/// Prints the script.
pub fn completions(args: &CompletionsArgs, mut program: clap::Command) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut program, env!("CARGO_PKG_NAME"), &mut script);
    print(&String::from_utf8(script)?)
}

/// Prints or writes pages.
pub fn man(args: &ManArgs, program: clap::Command) -> Result<()> {
    // `rtfmesh help remesh` needs no page; `build` gives commands their full names.
    let mut program = program.disable_help_subcommand(true);
    program.build();
    if args.markdown {
        return print(&markdown::page(&program));
    }
    let Some(folder) = &args.dir else { return print(&page(&program)?.1) };
    std::fs::create_dir_all(folder).map_err(|error| {
        let problem = format!("the folder cannot be created ({error})");
        Error::output(folder, problem, "choose another folder").caused_by(error)
    })?;
    for command in std::iter::once(&program).chain(program.get_subcommands()) {
        let (name, text) = page(command)?;
        io::write_text(folder.join(name), &text)?;
    }
    Ok(())
}

/// The name of a command's page, and its text.
fn page(command: &clap::Command) -> Result<(String, String)> {
    let version = concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION"));
    let man = Man::new(command.clone()).source(version);
    let mut text = Vec::new();
    man.render_title(&mut text)?;
    man.render_name_section(&mut text)?;
    man.render_synopsis_section(&mut text)?;
    man.render_description_section(&mut text)?;
    man.render_options_section(&mut text)?;
    if command.has_subcommands() {
        man.render_subcommands_section(&mut text)?;
    }
    if let Some(after) = command.get_after_long_help().or(command.get_after_help()) {
        closing(&after.to_string()).to_writer(&mut text)?;
    }
    Ok((man.get_filename(), String::from_utf8(text)?))
}

/// What help ends with; clap_mangen would run its lines together.
fn closing(after: &str) -> Roff {
    let mut roff = Roff::default();
    if let Some(examples) = after.strip_prefix("Examples:\n") {
        roff.control("SH", ["EXAMPLES"]).control("nf", []);
        for line in examples.lines() {
            roff.text([roman(line.trim())]);
        }
        roff.control("fi", []);
    } else {
        roff.control("SH", ["NOTES"]);
        for line in after.lines() {
            roff.control("PP", []).text([roman(line)]);
        }
    }
    roff
}
