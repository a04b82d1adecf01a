//! Parameters of the ranker: penalties for risk and source, and the optional quality score.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::RuleViolation;

/// Number of decay weights of a metric.
pub const DECAY_LENGTH: usize = 16;

const DECAY: [f64; DECAY_LENGTH] =
    [1.0, 0.8, 0.64, 0.51, 0.41, 0.33, 0.26, 0.21, 0.17, 0.13, 0.1, 0.08, 0.067, 0.053, 0.043, 0.034];

/// Parameters of the ranker.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RankerParameters {
    /// Penalty for the risk that the validator found.
    pub safety: SafetyParameters,
    /// Penalty for the generator.
    pub source: SourceParameters,
    /// Penalty for poor quality.
    pub evaluation: EvaluationParameters,
}

/// Name of a risk level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RiskName {
    /// Level 0.
    Safe,
    /// Level 1.
    LowCaution,
    /// Level 2.
    HighCaution,
    /// Level 3.
    Danger,
    /// Level 4.
    Fatal,
}

impl RiskName {
    /// Name in parameter files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Safe => "safe",
            Self::LowCaution => "low_caution",
            Self::HighCaution => "high_caution",
            Self::Danger => "danger",
            Self::Fatal => "fatal",
        }
    }
}

/// Penalty for the risk that the validator found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SafetyParameters {
    /// Count this penalty.
    pub enable: bool,
    /// Risk levels, each with the penalty at its place in safety.penalty. A level that is not listed costs 1.
    pub levels: Vec<RiskName>,
    /// Penalties of the levels.
    #[schemars(inner(range(min = 0.0)))]
    pub penalty: Vec<f64>,
    /// Weight of this penalty in the score.
    #[schemars(range(min = 0.0))]
    pub scale: f64,
}

impl Default for SafetyParameters {
    fn default() -> Self {
        Self {
            enable: true,
            levels: vec![
                RiskName::Safe,
                RiskName::LowCaution,
                RiskName::HighCaution,
                RiskName::Danger,
                RiskName::Fatal,
            ],
            penalty: vec![0.0, 0.1, 0.4, 1.0, 1.0],
            scale: 20.0,
        }
    }
}

/// Name of a kind of generator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SourceName {
    /// Learned planner.
    DiffusionPlanner,
    /// Rule-based planner that goes on.
    BackupPlannerGo,
    /// Rule-based planner that stops.
    BackupPlannerStop,
}

impl SourceName {
    /// All kinds, in the order of the shipped penalties.
    pub const ALL: [Self; 3] = [Self::DiffusionPlanner, Self::BackupPlannerGo, Self::BackupPlannerStop];

    /// Name in parameter files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::DiffusionPlanner => "diffusion_planner",
            Self::BackupPlannerGo => "backup_planner_go",
            Self::BackupPlannerStop => "backup_planner_stop",
        }
    }

    /// Name in the node's log, as upstream writes it.
    #[must_use]
    pub const fn log_name(self) -> &'static str {
        match self {
            Self::DiffusionPlanner => "DIFFUSION_PLANNER",
            Self::BackupPlannerGo => "BACKUP_PLANNER_GO",
            Self::BackupPlannerStop => "BACKUP_PLANNER_STOP",
        }
    }
}

/// Penalty for the generator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SourceParameters {
    /// Count this penalty.
    pub enable: bool,
    /// Generators, each with the penalty at its place in source.penalty. One that is not listed costs 1.
    pub levels: Vec<SourceName>,
    /// Penalties of the generators.
    #[schemars(inner(range(min = 0.0)))]
    pub penalty: Vec<f64>,
    /// Weight of this penalty in the score.
    #[schemars(range(min = 0.0))]
    pub scale: f64,
}

impl Default for SourceParameters {
    fn default() -> Self {
        Self {
            enable: true,
            levels: vec![
                SourceName::DiffusionPlanner,
                SourceName::BackupPlannerGo,
                SourceName::BackupPlannerStop,
            ],
            penalty: vec![0.0, 0.45, 0.5],
            scale: 5.0,
        }
    }
}

/// A metric of the quality score, by class name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum QualityMetric {
    /// Lateral acceleration, smaller is better.
    #[serde(rename = "autoware::trajectory_ranker::metrics::LateralAcceleration")]
    LateralAcceleration,
    /// Longitudinal jerk, smaller is better.
    #[serde(rename = "autoware::trajectory_ranker::metrics::LongitudinalJerk")]
    LongitudinalJerk,
    /// Distance travelled, larger is better.
    #[serde(rename = "autoware::trajectory_ranker::metrics::TravelDistance")]
    TravelDistance,
    /// Distance from the centre line, smaller is better.
    #[serde(rename = "autoware::trajectory_ranker::metrics::LateralDeviation")]
    LateralDeviation,
    /// Difference from the last steering command, smaller is better.
    #[serde(rename = "autoware::trajectory_ranker::metrics::SteeringConsistency")]
    SteeringConsistency,
    /// Spread against the last chosen trajectories, smaller is better.
    #[serde(rename = "autoware::trajectory_ranker::metrics::TrajectoryConsistency")]
    TrajectoryConsistency,
}

impl QualityMetric {
    /// All metrics, in the order of the shipped list.
    pub const ALL: [Self; 6] = [
        Self::LateralAcceleration,
        Self::LongitudinalJerk,
        Self::TravelDistance,
        Self::LateralDeviation,
        Self::SteeringConsistency,
        Self::TrajectoryConsistency,
    ];

    /// Name in `evaluation.plugin_names`.
    #[must_use]
    pub const fn class_name(self) -> &'static str {
        match self {
            Self::LateralAcceleration => "autoware::trajectory_ranker::metrics::LateralAcceleration",
            Self::LongitudinalJerk => "autoware::trajectory_ranker::metrics::LongitudinalJerk",
            Self::TravelDistance => "autoware::trajectory_ranker::metrics::TravelDistance",
            Self::LateralDeviation => "autoware::trajectory_ranker::metrics::LateralDeviation",
            Self::SteeringConsistency => "autoware::trajectory_ranker::metrics::SteeringConsistency",
            Self::TrajectoryConsistency => "autoware::trajectory_ranker::metrics::TrajectoryConsistency",
        }
    }
}

/// Penalty for poor quality.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EvaluationParameters {
    /// Count this penalty.
    pub enable: bool,
    /// Metrics of the quality score.
    #[schemars(extend("x-read-only" = true))]
    pub plugin_names: Vec<QualityMetric>,
    /// Weight of this penalty in the score.
    #[schemars(range(min = 0.0))]
    pub scale: f64,
    /// Number of samples of a candidate.
    #[schemars(range(min = 2, max = 1000))]
    pub sampling_number: i64,
    /// Time between samples.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "s"))]
    pub sampling_resolution: f64,
    /// Number of chosen trajectories that are remembered.
    #[schemars(range(min = 1, max = 100))]
    pub trajectory_history_size: i64,
    /// Place for a YAML anchor that the metrics refer to; nothing depends on it.
    #[schemars(inner(range(min = 0.0)))]
    pub decay_weight_base: [f64; DECAY_LENGTH],
    /// Lateral acceleration.
    pub lateral_acceleration: MetricParameters,
    /// Longitudinal jerk.
    pub longitudinal_jerk: MetricParameters,
    /// Distance travelled.
    pub travel_distance: MetricParameters,
    /// Distance from the centre line.
    pub lateral_deviation: MetricParameters,
    /// Difference from the last steering command.
    pub steering_consistency: MetricParameters,
    /// Spread against the last chosen trajectories.
    pub trajectory_consistency: ConsistencyMetricParameters,
}

/// One metric of the quality score.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MetricParameters {
    /// Count this metric.
    pub enable: bool,
    /// Weight in the quality score.
    #[schemars(range(min = 0.0))]
    pub weight: f64,
    /// Value, in the metric's own unit, that counts as 1.
    #[schemars(range(min = 0.0))]
    pub maximum: f64,
    /// Weights of the samples, first to last.
    #[schemars(inner(range(min = 0.0)))]
    pub decay_weight: [f64; DECAY_LENGTH],
}

/// The metric that compares with the last chosen trajectories.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConsistencyMetricParameters {
    /// Count this metric.
    pub enable: bool,
    /// Weight in the quality score.
    #[schemars(range(min = 0.0))]
    pub weight: f64,
    /// Value that counts as 1.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub maximum: f64,
    /// Weights of the samples, first to last.
    #[schemars(inner(range(min = 0.0)))]
    pub decay_weight: [f64; DECAY_LENGTH],
    /// How far ahead of its stamp a trajectory is compared.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub time_horizon: f64,
}

impl Default for EvaluationParameters {
    fn default() -> Self {
        let metric =
            |weight, maximum| MetricParameters { enable: true, weight, maximum, decay_weight: DECAY };
        Self {
            enable: false,
            plugin_names: QualityMetric::ALL.to_vec(),
            scale: 1.0,
            sampling_number: 16,
            sampling_resolution: 0.5,
            trajectory_history_size: 10,
            decay_weight_base: DECAY,
            lateral_acceleration: metric(0.1, 5.0),
            longitudinal_jerk: metric(0.1, 10.0),
            travel_distance: metric(0.3, 500.0),
            lateral_deviation: metric(0.3, 10.0),
            steering_consistency: metric(0.3, 0.1),
            trajectory_consistency: ConsistencyMetricParameters {
                enable: true,
                weight: 0.2,
                maximum: 1.0,
                decay_weight: DECAY,
                time_horizon: 2.0,
            },
        }
    }
}

/// What is set for one metric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetricSettings<'a> {
    /// Whether it counts.
    pub enable: bool,
    /// Weight in the quality score.
    pub weight: f64,
    /// Value, in the metric's own unit, that counts as 1.
    pub maximum: f64,
    /// Weights of the samples, first to last.
    pub decay_weight: &'a [f64; DECAY_LENGTH],
}

impl EvaluationParameters {
    /// What is set for a metric.
    #[must_use]
    pub fn of(&self, metric: QualityMetric) -> MetricSettings<'_> {
        let MetricParameters { enable, weight, maximum, decay_weight } = match metric {
            QualityMetric::LateralAcceleration => &self.lateral_acceleration,
            QualityMetric::LongitudinalJerk => &self.longitudinal_jerk,
            QualityMetric::TravelDistance => &self.travel_distance,
            QualityMetric::LateralDeviation => &self.lateral_deviation,
            QualityMetric::SteeringConsistency => &self.steering_consistency,
            QualityMetric::TrajectoryConsistency => {
                let ConsistencyMetricParameters { enable, weight, maximum, decay_weight, .. } =
                    &self.trajectory_consistency;
                return MetricSettings { enable: *enable, weight: *weight, maximum: *maximum, decay_weight };
            }
        };
        MetricSettings { enable: *enable, weight: *weight, maximum: *maximum, decay_weight }
    }
}

impl SafetyParameters {
    /// Penalty of a risk level: that at its place in the list, 1 if it has none.
    #[must_use]
    pub fn penalty_of(&self, risk: RiskName) -> f64 {
        penalty_at(&self.levels, &self.penalty, &risk)
    }
}

impl SourceParameters {
    /// Penalty of a kind of generator: that at its place in the list, 1 if it has none.
    #[must_use]
    pub fn penalty_of(&self, source: SourceName) -> f64 {
        penalty_at(&self.levels, &self.penalty, &source)
    }
}

fn penalty_at<T: PartialEq>(levels: &[T], penalty: &[f64], level: &T) -> f64 {
    let place = levels.iter().position(|listed| listed == level);
    place.and_then(|place| penalty.get(place)).copied().unwrap_or(1.0)
}

impl RankerParameters {
    /// Rules between parameters. Empty when all hold.
    #[must_use]
    pub fn violations(&self) -> Vec<RuleViolation> {
        let mut found = Vec::new();
        let risks: Vec<_> = self.safety.levels.iter().map(|level| level.name()).collect();
        let sources: Vec<_> = self.source.levels.iter().map(|level| level.name()).collect();
        let metrics: Vec<_> = self.evaluation.plugin_names.iter().map(|metric| metric.class_name()).collect();
        check_penalties("safety", &risks, &self.safety.penalty, &mut found);
        check_penalties("source", &sources, &self.source.penalty, &mut found);
        check_repeated("evaluation.plugin_names", &metrics, &mut found);
        let scales = [self.safety.scale, self.source.scale, self.evaluation.scale];
        if !scales.iter().any(|scale| *scale > 0.0) {
            found.push(RuleViolation::NoPositiveWeight {
                parameter: "safety.scale".to_owned(),
                others: "source.scale and evaluation.scale".to_owned(),
            });
        }
        found
    }
}

fn check_penalties(group: &str, levels: &[&str], penalty: &[f64], found: &mut Vec<RuleViolation>) {
    check_repeated(&format!("{group}.levels"), levels, found);
    if levels.len() != penalty.len() {
        found.push(RuleViolation::UnequalLengths {
            parameter: format!("{group}.penalty"),
            length: penalty.len(),
            other: format!("{group}.levels"),
            other_length: levels.len(),
        });
    }
}

fn check_repeated(parameter: &str, list: &[&str], found: &mut Vec<RuleViolation>) {
    let repeated = list.iter().enumerate().find(|(at, entry)| list[..*at].contains(entry));
    if let Some((_, entry)) = repeated {
        found.push(RuleViolation::Repeated { parameter: parameter.to_owned(), entry: (*entry).to_owned() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(change: impl FnOnce(&mut RankerParameters)) -> Vec<String> {
        let mut parameters = RankerParameters::default();
        change(&mut parameters);
        parameters.violations().iter().map(|v| format!("{} {v}", v.parameter())).collect()
    }

    #[test]
    fn rules() {
        type Case = (fn(&mut RankerParameters), &'static str);
        let cases: [Case; 4] = [
            (|p| p.safety.penalty.truncate(4), "safety.penalty has 4 entries but `safety.levels` has 5"),
            (
                |p| p.source.levels[1] = SourceName::DiffusionPlanner,
                "source.levels names `diffusion_planner`",
            ),
            (
                |p| p.evaluation.plugin_names.push(QualityMetric::TravelDistance),
                "evaluation.plugin_names names `autoware::trajectory_ranker::metrics::TravelDistance`",
            ),
            (
                |p| {
                    p.safety.scale = 0.0;
                    p.source.scale = 0.0;
                    p.evaluation.scale = 0.0;
                },
                "safety.scale is 0",
            ),
        ];
        for (change, expected) in cases {
            let found = found(change);
            assert_eq!(found.len(), 1, "{found:?}");
            assert!(found[0].starts_with(expected), "{found:?}");
        }
    }

    #[test]
    fn what_is_not_listed_costs_one() {
        let mut safety = SafetyParameters::default();
        assert_eq!(safety.penalty_of(RiskName::HighCaution), 0.4);
        safety.levels.retain(|level| *level != RiskName::Safe);
        assert_eq!(safety.penalty_of(RiskName::Safe), 1.0);
        assert_eq!(safety.penalty_of(RiskName::LowCaution), 0.0, "places shift with the list");
        safety.penalty.truncate(1);
        assert_eq!(safety.penalty_of(RiskName::HighCaution), 1.0, "beyond the penalties");
        let source = SourceParameters { levels: Vec::new(), ..SourceParameters::default() };
        assert_eq!(source.penalty_of(SourceName::DiffusionPlanner), 1.0);
    }

    #[test]
    fn one_positive_scale_is_enough() {
        assert_eq!(
            found(|p| {
                p.safety.scale = 0.0;
                p.evaluation.scale = 0.0;
            }),
            Vec::<String>::new()
        );
    }

    #[test]
    fn names_are_those_of_serialisation() {
        for level in SafetyParameters::default().levels {
            assert_eq!(serde_json::to_value(level).unwrap(), level.name());
        }
        for source in SourceParameters::default().levels {
            assert_eq!(serde_json::to_value(source).unwrap(), source.name());
        }
        for metric in QualityMetric::ALL {
            assert_eq!(serde_json::to_value(metric).unwrap(), metric.class_name());
        }
    }
}
