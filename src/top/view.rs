//! Draws the board. The same board, look and size give the same screen.
//!
//! Made for 80 columns and 24 lines; what has more room shows more generators, more reasons and more warnings, and the
//! names of the filters in full.

mod verdicts;

use super::board::{Board, Health};
use messages::diagnostic_msgs::DiagnosticStatus;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Bar, BarChart, Block, Borders, Paragraph};
use std::time::Duration;

/// Lines of the latency histogram, its title included.
const LATENCY_LINES: u16 = 7;
/// Columns of one bar: as many as its label has.
const BAR_COLUMNS: u16 = 3;
/// Lines above which warnings get more of them.
const TALL: u16 = 32;

/// How the board is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Look<'a> {
    /// What is watched.
    pub source: &'a str,
    /// Which generator is looked at closely, by its place in the table.
    pub selected: usize,
    /// Whether the screen stands still.
    pub is_paused: bool,
    /// Now, since the board began.
    pub now: Duration,
}

const SOFT: Style = Style::new().fg(Color::DarkGray);
const GOOD: Style = Style::new().fg(Color::Green);
const DOUBT: Style = Style::new().fg(Color::Yellow);
const BAD: Style = Style::new().fg(Color::Red);
const STRONG: Style = Style::new().add_modifier(Modifier::BOLD);

/// Draws everything.
pub fn draw(frame: &mut Frame<'_>, board: &Board, look: Look<'_>) {
    let area = frame.area();
    let warnings = if area.height >= TALL { 9 } else { 3 };
    let parts = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(3),
        Constraint::Min(4),
        Constraint::Length(LATENCY_LINES),
        Constraint::Length(warnings),
        Constraint::Length(1),
    ]);
    let [title, status, verdicts, below, warnings, keys] = parts.areas(area);
    draw_title(frame, board, look, title);
    frame.render_widget(Paragraph::new(status_lines(board, look)), status);
    verdicts::draw(frame, board, look.selected, verdicts);
    let bars = u16::try_from(Board::LATENCY_LABELS.len()).unwrap_or(0) * BAR_COLUMNS;
    let [latency, why] = Layout::horizontal([Constraint::Length(bars + 1), Constraint::Min(0)]).areas(below);
    draw_latency(frame, board, latency);
    verdicts::draw_reasons(frame, board, look.selected, why);
    draw_warnings(frame, board, look, warnings);
    let keys_text = " q quit   space hold   ↑ ↓ Tab generator";
    frame.render_widget(Paragraph::new(keys_text).style(SOFT), keys);
}

/// What is watched, and on the right how far it is; a long path gives way.
fn draw_title(frame: &mut Frame<'_>, board: &Board, look: Look<'_>, area: Rect) {
    let mut state = format!(" {:.1} s ", board.elapsed_s());
    if let Some(ended) = &board.ended {
        state += &format!(" {ended} ");
    } else if board.cycles() == 0 {
        state += " waiting for the first cycle ";
    }
    if look.is_paused {
        state += " HELD ";
    }
    let columns = u16::try_from(state.chars().count()).unwrap_or(u16::MAX).min(area.width);
    let [left, right] = Layout::horizontal([Constraint::Min(0), Constraint::Length(columns)]).areas(area);
    let program = " trajectory-selector ";
    let room = left.width.saturating_sub(u16::try_from(program.len()).unwrap_or(u16::MAX));
    let bar = Style::new().add_modifier(Modifier::REVERSED);
    let source = verdicts::shortened(look.source, room);
    let source = Line::from(vec![Span::styled(program, STRONG), Span::raw(source)]);
    frame.render_widget(Paragraph::new(source).style(bar), left);
    frame.render_widget(Paragraph::new(state).style(bar.patch(STRONG)), right);
}

fn status_lines<'a>(board: &'a Board, look: Look<'_>) -> Vec<Line<'a>> {
    let mut rate = vec![
        Span::styled(format!(" {:.1} Hz", board.rate_hz(look.now)), STRONG),
        Span::raw(format!("  {} cycles", board.cycles())),
    ];
    for (trigger, count) in &board.triggers {
        rate.push(Span::raw(format!("  {trigger} {count}")));
    }
    for (part, Health { level, .. }) in &board.health {
        let (word, style) = level_of(*level);
        rate.push(Span::raw(format!("  {} ", part.trim_start_matches("trajectory_"))));
        rate.push(Span::styled(word, style));
    }
    vec![rate.into(), last_cycle(board), inputs(board)]
}

/// What came out, and what is wrong with it in the node's own words.
fn last_cycle(board: &Board) -> Line<'_> {
    if board.cycles() == 0 {
        return Line::default();
    }
    let (of, accepted, chosen) = &board.last;
    let mut spans = vec![Span::raw(format!(" last: {}, {accepted} of {of} accepted, ", board.last_trigger))];
    spans.push(match chosen {
        Some(generator) => Span::styled(format!("{generator} drives"), GOOD),
        None => Span::styled("nothing drives", BAD),
    });
    for Health { level, message } in
        board.health.values().filter(|health| health.level != DiagnosticStatus::OK)
    {
        spans.push(Span::styled(format!("  {message}"), level_of(*level).1));
    }
    spans.into()
}

fn level_of(level: u8) -> (&'static str, Style) {
    match level {
        DiagnosticStatus::OK => ("OK", GOOD),
        DiagnosticStatus::WARN => ("WARN", DOUBT),
        DiagnosticStatus::ERROR => ("ERROR", BAD.add_modifier(Modifier::BOLD)),
        _ => ("STALE", DOUBT),
    }
}

/// How old each input is, and what was lost.
fn inputs(board: &Board) -> Line<'_> {
    let mut spans = vec![Span::styled(" ages, s:", SOFT)];
    for (key, value) in &board.inputs {
        let name = key.trim_start_matches("input.");
        match name.strip_suffix(".age_s") {
            Some(name) => spans.push(match value.parse::<f64>() {
                Ok(age_s) => Span::raw(format!(" {name} {age_s:.2} ")),
                Err(_) => Span::styled(format!(" {name} never "), DOUBT),
            }),
            None => spans.push(Span::styled(format!(" {name} {value} "), BAD)),
        }
    }
    spans.into()
}

/// As many digits as tell something.
fn three_digits(value: f64) -> String {
    match value {
        value if value < 1.0 => format!("{value:.2}"),
        value if value < 100.0 => format!("{value:.1}"),
        value => format!("{value:.0}"),
    }
}

/// A count that fits into four columns.
fn short(count: u64) -> String {
    match count {
        0..10_000 => count.to_string(),
        10_000..1_000_000 => format!("{}k", count / 1_000),
        _ => format!("{}M", count / 1_000_000),
    }
}

/// The upper line of a part, with its title.
fn titled(title: String) -> Block<'static> {
    Block::new().borders(Borders::TOP).border_style(SOFT).title(Span::styled(title, STRONG))
}

fn draw_latency(frame: &mut Frame<'_>, board: &Board, area: Rect) {
    let title = match board.latency_ms() {
        Some(of) => {
            let [p50, p99, max] = of.map(three_digits);
            format!(" ms: p50 {p50} p99 {p99} max {max} ")
        }
        None => " time of a cycle, ms ".to_owned(),
    };
    let bars: Vec<Bar<'_>> = board
        .latency_bars()
        .iter()
        .zip(Board::LATENCY_LABELS)
        .map(|(&count, label)| Bar::with_label(label, count).text_value(""))
        .collect();
    let chart = BarChart::vertical(bars)
        .bar_width(BAR_COLUMNS)
        .bar_gap(0)
        .bar_style(Style::new().fg(Color::Blue))
        .label_style(SOFT)
        .block(titled(title));
    frame.render_widget(chart, area);
}

fn draw_warnings(frame: &mut Frame<'_>, board: &Board, look: Look<'_>, area: Rect) {
    let shown = usize::from(area.height.saturating_sub(1));
    let lines: Vec<Line<'_>> = board
        .warnings
        .iter()
        .rev()
        .take(shown)
        .map(|warning| {
            let ago_s = look.now.saturating_sub(warning.last).as_secs();
            let when = format!("{ago_s:>4} s ago {:>5}x ", warning.count);
            Line::from(vec![Span::styled(when, SOFT), Span::raw(&warning.text)])
        })
        .collect();
    let title = if board.warnings.is_empty() { " no warnings " } else { " warnings " };
    frame.render_widget(Paragraph::new(lines).block(titled(title.to_owned())), area);
}

#[cfg(test)]
mod tests;
