//! What the log says about a cycle's choice.

use super::throttle::Throttle;
use crate::cycle::{CycleReport, Judged};
use selection::ranker::{Ranked, Unrankable};
use std::collections::BTreeMap;
use tracing::{error, info, warn};

/// Scores below this are worth a warning.
const LOW_SCORE: f32 = 0.5;
/// How often the same text is written, ms.
const PERIOD_MS: i64 = 1000;
/// Whose texts they are, for the throttle.
const SOURCE: &str = "ranker";

/// Writes why there is no trajectory, or what is remarkable about the one that there is.
pub(super) fn write(report: &CycleReport, judged: &Judged, throttle: &mut Throttle) {
    let now = report.cycle.scene.now;
    let candidates = &report.cycle.concatenated.candidates;
    let mut unranked: BTreeMap<(&str, Unrankable), usize> = BTreeMap::new();
    for (index, why) in &judged.ranking.unranked {
        *unranked.entry((&candidates[*index].generator_name, *why)).or_default() += 1;
    }
    for ((generator, why), count) in unranked {
        if throttle.allows(now, PERIOD_MS, SOURCE, &format!("{generator}: {why}")) {
            warn!("[Ranker] {count} candidates of {generator} cannot be ranked: {why}");
        }
    }
    match (judged.ranking.best(), &judged.selected) {
        (Some(best), Some(_)) => {
            write_choice(judged, best, |text| throttle.allows(now, PERIOD_MS, SOURCE, text));
        }
        _ => {
            let why = no_choice(judged);
            if throttle.allows(now, PERIOD_MS, SOURCE, why) {
                let panic =
                    judged.ranking.failure.as_ref().map_or(String::new(), |panic| format!(": {panic}"));
                error!("Failed to rank trajectories: No best trajectory found. {why}{panic}");
            }
        }
    }
}

/// Why nothing can be driven.
pub(super) fn no_choice(judged: &Judged) -> &'static str {
    if judged.ranking.failure.is_some() {
        "The ranker panicked"
    } else if judged.validated.candidate_trajectories.is_empty() {
        "Every candidate was rejected"
    } else if judged.ranking.ranked.is_empty() {
        "None of the accepted candidates can be ranked"
    } else {
        // The last gate held back what the ranking chose: a defect.
        "The best candidate was not accepted in this cycle"
    }
}

fn write_choice(judged: &Judged, best: &Ranked, mut allows: impl FnMut(&str) -> bool) {
    let source = best.source.log_name();
    let previous = judged.ranking.previous_source.map_or("none", |previous| previous.log_name());
    let is_low = best.score < LOW_SCORE && allows("low score");
    if source != previous {
        warn!("[Ranker] Best trajectory source changed from {previous} to {source}");
    }
    if is_low {
        warn!("[Ranker] Best trajectory score is low: {:.6}", best.score);
    }
    if source != previous || is_low {
        let penalties = best.penalties;
        info!(
            "[Ranker] safety penalty {:.6}, source penalty {:.6}, quality penalty {:.6}, score {:.6}",
            penalties.safety, penalties.source, penalties.quality, best.score
        );
    }
}
