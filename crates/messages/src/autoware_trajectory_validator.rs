//! `autoware_trajectory_validator`: what the validator says about each candidate.

use crate::builtin_interfaces::Time;
use crate::define::message;
use crate::unique_identifier_msgs::Uuid;
use std::borrow::Cow;

message! {
    /// How bad a finding is; larger is worse.
    #[derive(Copy, Eq, PartialOrd, Ord, Default)]
    RiskLevel = "autoware_trajectory_validator/msg/RiskLevel" {
        /// One of the constants.
        level: u8,
    }
    constants {
        /// Nothing found.
        SAFE: u8 = 0,
        /// Worth a note.
        LOW_CAUTION: u8 = 1,
        /// Beyond a limit.
        HIGH_CAUTION: u8 = 2,
        /// Must not be driven.
        DANGER: u8 = 3,
        /// The check itself failed.
        FATAL: u8 = 4,
    }
}

message! {
    /// One measurement of one validator.
    #[derive(Default)]
    MetricReport = "autoware_trajectory_validator/msg/MetricReport" {
        /// Validator, for example `vehicle_constraint_filter`.
        validator_name: Cow<'static, str>,
        /// Its category, for example `safety`.
        validator_category: Cow<'static, str>,
        /// Metric, for example `check_speed`.
        metric_name: Cow<'static, str>,
        /// Its value; the unit is the metric's.
        metric_value: f64,
        /// How bad that is.
        risk: RiskLevel,
    }
}

message! {
    /// All measurements of one candidate.
    #[derive(Default)]
    ValidationReport = "autoware_trajectory_validator/msg/ValidationReport" {
        /// Stamp of the candidate.
        trajectory_stamp: Time,
        /// Planner that made it.
        generator_id: Uuid,
        /// Its name.
        generator_name: String,
        /// Worst risk over the enforced validators.
        risk: RiskLevel,
        /// Measurements in order of evaluation, those of shadow validators included.
        metrics: Vec<MetricReport>,
    }
}

message! {
    /// One report for each candidate judged, rejected ones included, in input order.
    #[derive(Default)]
    ValidationReportArray = "autoware_trajectory_validator/msg/ValidationReportArray" {
        /// The reports.
        reports: Vec<ValidationReport>,
    }
}
