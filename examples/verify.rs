//! Compares the filters' verdicts with golden sequences: `verify [--maps FOLDER] [--filter NAME] [--json] PATH...`
use std::process::ExitCode;

use trajectory_selector::commands::verify::{Options, run};

fn main() -> ExitCode {
    let mut options = Options::default();
    let mut json = false;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--json" => json = true,
            "--maps" => options.maps = arguments.next().map(Into::into),
            "--filter" => options.filters.extend(arguments.next()),
            path => options.paths.push(path.into()),
        }
    }
    match run(&options) {
        Ok(report) => {
            let text = if json {
                serde_json::to_string_pretty(&report).unwrap_or_default()
            } else {
                report.to_string()
            };
            println!("{text}");
            ExitCode::from(report.exit_code())
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
