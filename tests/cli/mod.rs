//! The program as a user runs it.

pub mod attributes;
pub mod batch;
pub mod cells;
pub mod commands;
#[cfg(target_os = "linux")]
pub mod drivers;
pub mod errors;
pub mod files;
pub mod first_steps;
pub mod follow;
pub mod html;
pub mod inspect;
pub mod kept;
#[cfg(unix)]
pub mod odd_files;
pub mod render;
pub mod repair;
pub mod shell;
pub mod sizing;
pub mod stop;
pub mod wrap;
