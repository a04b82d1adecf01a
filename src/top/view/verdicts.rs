//! Who is accepted, and who objects to whom and why.

use super::{BAD, DOUBT, GOOD, SOFT, STRONG, short, three_digits, titled};
use crate::top::board::{Board, Column, Row};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Cell, Paragraph, Table, TableState};

/// Columns of the counts before those of the filters: judged, share of accepted ones, chosen.
const COUNT_COLUMNS: [u16; 3] = [6, 4, 6];
/// No filter gets more columns than this.
const MOST_FILTER_COLUMNS: u16 = 16;

/// Generators by filter. Below them their sum, and what a filter takes of a cycle.
pub(super) fn draw(frame: &mut Frame<'_>, board: &Board, selected: usize, area: Rect) {
    let columns = board.columns_in_order();
    let widths = widths(board, &columns, area.width);
    let block = titled(" objections by generator and filter (~ shadow: nothing is removed) ".to_owned());
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let [upper, lower] = Layout::vertical([Constraint::Min(0), Constraint::Length(2)]).areas(inner);

    let heads = ["judged", "ok %", "chosen"].map(|head| Cell::from(Line::from(head).right_aligned()));
    let filters = columns.iter().zip(&widths[4..]).map(|((name, column), width)| {
        Cell::from(Line::from(head(name, column.is_shadow, *width)).right_aligned())
    });
    let heads = std::iter::once(Cell::from("generator")).chain(heads);
    let header = ratatui::widgets::Row::new(heads.chain(filters)).style(SOFT);
    let rows = board.rows.iter().map(|(name, row)| table_row(shortened(name, widths[0]), row, &columns));
    let constraints = || widths.iter().map(|width| Constraint::Length(*width));
    let table = Table::new(rows, constraints())
        .header(header)
        .column_spacing(1)
        .row_highlight_style(Style::new().add_modifier(Modifier::REVERSED));
    let mut state = TableState::new();
    if !board.rows.is_empty() {
        state.select(Some(selected.min(board.rows.len() - 1)));
    }
    frame.render_stateful_widget(table, upper, &mut state);

    let took = columns.iter().map(|(_, column)| {
        let p99 = column.p99_us().map_or("–".to_owned(), |microseconds| three_digits(microseconds / 1e3));
        Cell::from(Line::from(p99).right_aligned())
    });
    let blank = ["", "", ""].map(Cell::from);
    let took = std::iter::once(Cell::from("p99 of a cycle, ms")).chain(blank).chain(took);
    let sums = [
        table_row("all".to_owned(), &board.total(), &columns).style(STRONG),
        ratatui::widgets::Row::new(took).style(SOFT),
    ];
    frame.render_widget(Table::new(sums, constraints()).column_spacing(1), lower);
}

/// Fewest columns of a generator's name.
const NAME_COLUMNS: u16 = 18;

/// Widths of all columns: of the generators, the counts, the filters. What the filters leave is for the names.
fn widths(board: &Board, columns: &[(&str, &Column)], total: u16) -> Vec<u16> {
    let filters = u16::try_from(columns.len()).unwrap_or(u16::MAX);
    let counts = COUNT_COLUMNS.iter().map(|width| width + 1).sum::<u16>();
    let left = total.saturating_sub(NAME_COLUMNS + counts);
    let each = (left / filters.max(1)).saturating_sub(1).clamp(4, MOST_FILTER_COLUMNS);
    let longest = board.rows.keys().map(|name| name.chars().count()).max().unwrap_or(0);
    let most = total.saturating_sub(counts + filters.saturating_mul(each + 1)).max(NAME_COLUMNS);
    let name = u16::try_from(longest).unwrap_or(u16::MAX).clamp(NAME_COLUMNS, most);
    std::iter::once(name).chain(COUNT_COLUMNS).chain(columns.iter().map(|_| each)).collect()
}

/// A name that fits. Names of planners often differ at their ends, so what is cut out is the middle.
pub(super) fn shortened(name: &str, width: u16) -> String {
    let (length, width) = (name.chars().count(), usize::from(width));
    if length <= width {
        return name.to_owned();
    }
    if width == 0 {
        return String::new();
    }
    let (head, tail) = (width / 2, width.saturating_sub(width / 2 + 1));
    name.chars().take(head).chain(['…']).chain(name.chars().skip(length - tail)).collect()
}

/// As much of a filter's name as there is room for; its first words say most.
fn head(name: &str, is_shadow: bool, width: u16) -> String {
    let name = name.trim_end_matches("_filter").replace('_', " ");
    let marked = if is_shadow { format!("~{name}") } else { name };
    marked.chars().take(usize::from(width)).collect()
}

fn table_row(name: String, row: &Row, columns: &[(&str, &Column)]) -> ratatui::widgets::Row<'static> {
    let number = |text: String, style: Style| Cell::from(Line::from(text).right_aligned()).style(style);
    let share = if row.judged == 0 { f64::NAN } else { 100.0 * row.accepted as f64 / row.judged as f64 };
    let (share_text, share_style) = match share {
        share if share.is_nan() => ("–".to_owned(), SOFT),
        0.0 => ("0".to_owned(), BAD),
        share => (format!("{share:.0}"), if row.accepted == row.judged { GOOD } else { Style::new() }),
    };
    let plain = Style::new();
    let counts = [
        Cell::from(name),
        number(short(row.judged), plain),
        number(share_text, share_style),
        number(short(row.chosen), plain),
    ];
    let objections = columns.iter().map(|(filter, column)| match row.objections.get(*filter) {
        None => number("·".to_owned(), SOFT),
        Some(count) => number(short(*count), if column.is_shadow { DOUBT } else { BAD }),
    });
    ratatui::widgets::Row::new(counts.into_iter().chain(objections))
}

/// What the objections to the selected generator are about, the most frequent first.
pub(super) fn draw_reasons(frame: &mut Frame<'_>, board: &Board, selected: usize, area: Rect) {
    let last = board.rows.len().saturating_sub(1);
    let Some((name, row)) = board.rows.iter().nth(selected.min(last)) else {
        frame.render_widget(titled(" why ".to_owned()), area);
        return;
    };
    let mut reasons: Vec<_> = row.reasons.iter().collect();
    reasons.sort_by(|(name, count), (other_name, other)| other.cmp(count).then_with(|| name.cmp(other_name)));
    let shown = usize::from(area.height.saturating_sub(1));
    let lines: Vec<Line<'_>> = if reasons.is_empty() {
        vec![Line::styled(" nobody objects to it", GOOD)]
    } else {
        let lines = reasons.iter().take(shown).map(|((filter, metric), count)| {
            let is_shadow = board.columns.get(filter).is_some_and(|column| column.is_shadow);
            let filter = filter.trim_end_matches("_filter");
            let style = if is_shadow { DOUBT } else { BAD };
            let what = if metric == filter { String::new() } else { format!(" {metric}") };
            Line::from(vec![
                Span::styled(format!("{count:>6} "), style),
                Span::raw(filter.to_owned()),
                Span::styled(what, SOFT),
            ])
        });
        lines.collect()
    };
    frame.render_widget(Paragraph::new(lines).block(titled(format!(" why not {name} "))), area);
}
