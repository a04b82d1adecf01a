//! The markers in a recording show what was published and reported, and are there only where they were asked for.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use messages::Interface;
use messages::foxglove_msgs::{SceneEntity, SceneEntityDeletion, SceneUpdate};
use messages::visualization_msgs::{Marker, MarkerArray};
use program::{Recorded, decode, number, read, reports, run, validated_sets};
use std::collections::{BTreeMap, BTreeSet};

fn drawn(recorded: &[Recorded], topic: &str) -> BTreeMap<i64, Vec<Marker>> {
    let arrays: Vec<(i64, MarkerArray)> = decode(recorded, topic, Interface::V0_53);
    arrays.into_iter().map(|(time, array)| (time, array.markers)).collect()
}

fn count(markers: &[Marker], namespaces: &[&str]) -> usize {
    markers.iter().filter(|marker| namespaces.contains(&&*marker.ns)).count()
}

/// Of every filter topic of a recording: its name, and its markers by time.
fn objections(recorded: &[Recorded]) -> BTreeMap<String, BTreeMap<i64, Vec<Marker>>> {
    let names: BTreeSet<&str> =
        recorded.iter().filter_map(|(topic, ..)| topic.split("/markers/").nth(1)).collect();
    let filters = names.into_iter().filter(|name| !["road", "scene"].contains(name));
    filters.map(|name| (name.to_owned(), drawn(recorded, &format!("/markers/{name}")))).collect()
}

#[test]
fn a_demo_shows_every_candidate_as_it_was_judged() {
    let folder = tempfile::tempdir().unwrap();
    let ran = run(&["demo", "--output", folder.path().to_str().unwrap()]);
    assert_eq!(ran.exit_code, 0, "{}", ran.stderr);
    let recorded = read(&folder.path().join("demo.mcap"));
    let scenes = drawn(&recorded, "/markers/scene");
    let mut seen = [0; 3];
    for (time, accepted) in validated_sets(&recorded) {
        let scene = &scenes[&time];
        assert_eq!((scene[0].action, scene.len() > 1), (Marker::DELETEALL, true));
        assert_eq!(count(scene, &["accepted", "doubted"]), accepted.candidate_trajectories.len());
        assert_eq!(count(scene, &["vehicle"]), 1);
        for (seen, namespace) in seen.iter_mut().zip(["rejected", "doubted", "selected"]) {
            *seen += count(scene, &[namespace]);
        }
    }
    // A candidate whose data is not valid may have no place to be drawn at.
    let rejected = number(&ran.json, &["candidates", "rejected"]);
    let invalid = number(&ran.json, &["rejections", "data_validity", "data_validity"]);
    let seen_rejected = u64::try_from(seen[0]).unwrap();
    assert!((rejected - invalid..=rejected).contains(&seen_rejected), "{seen_rejected} of {rejected}");
    assert!(seen.iter().all(|seen| *seen > 0), "{seen:?}");

    let objections = objections(&recorded);
    assert_eq!(objections.len(), 6, "one topic for each filter");
    for (time, report) in reports(&recorded) {
        let text = &drawn(&recorded, "/plugin_report_text")[&time][0].text;
        for (filter, cycles) in &objections {
            let markers = &cycles[&time];
            assert_eq!(markers[0].action, Marker::DELETEALL);
            let outlines = count(markers, &["violations"]);
            let told = count(markers, &["reasons"]);
            assert!(outlines <= told && told <= report.reports.len(), "{filter}: {outlines} of {told}");
            let line = text.lines().find(|line| line.starts_with(&format!("- {filter}: ")));
            assert!(line.is_some() || told == 0, "{filter} objects {told} times, but not in {text}");
        }
    }
    let violations: usize =
        objections.values().flat_map(BTreeMap::values).map(|markers| count(markers, &["violations"])).sum();
    assert!(violations > 0, "some filter objects at a place");

    let roads = drawn(&recorded, "/markers/road");
    assert!(roads.len() >= 2, "the road is drawn again and again");
    for road in roads.values() {
        assert!(count(road, &["lanes"]) == 1 && count(road, &["borders"]) == 1);
    }
}

/// What a click on an entity says under a key.
fn detail<'a>(entity: &'a SceneEntity, key: &str) -> Option<&'a str> {
    entity.metadata.iter().find(|pair| pair.key == key).map(|pair| &*pair.value)
}

#[test]
fn a_demo_tells_foxglove_what_was_found_about_every_candidate() {
    let folder = tempfile::tempdir().unwrap();
    let ran = run(&["demo", "--output", folder.path().to_str().unwrap()]);
    assert_eq!(ran.exit_code, 0, "{}", ran.stderr);
    let recorded = read(&folder.path().join("demo.mcap"));
    let updates: Vec<(i64, SceneUpdate)> = decode(&recorded, "/scene_updates/cycle", Interface::V0_53);
    let updates: BTreeMap<i64, SceneUpdate> = updates.into_iter().collect();
    let mut verdicts: BTreeMap<String, u64> = BTreeMap::new();
    let (mut selected, mut reasons) = (0, 0);
    for (time, reports) in reports(&recorded) {
        let update = &updates[&time];
        assert_eq!(update.deletions.len(), 1);
        assert_eq!(update.deletions[0].r#type, SceneEntityDeletion::ALL);
        let names: BTreeSet<&str> = update.entities.iter().map(|entity| &*entity.id).collect();
        assert_eq!(names.len(), update.entities.len(), "every entity has a name of its own");
        let candidates: Vec<_> =
            update.entities.iter().filter(|entity| entity.id.starts_with("candidate ")).collect();
        assert_eq!(candidates.len(), reports.reports.len());
        for (candidate, report) in candidates.into_iter().zip(&reports.reports) {
            assert_eq!(detail(candidate, "generator"), Some(&*report.generator_name));
            let verdict = detail(candidate, "verdict").unwrap();
            *verdicts.entry(verdict.to_owned()).or_default() += 1;
            selected += u64::from(detail(candidate, "selected").is_some());
            // What a filter objects to is told under its name, and nothing else is.
            for metric in
                report.metrics.iter().filter(|metric| metric.metric_name == "trajectory_feasibility")
            {
                let reason = detail(candidate, &metric.validator_name);
                assert_eq!(reason.is_some(), metric.metric_value == 0.0, "{}: {reason:?}", candidate.id);
                reasons += u64::from(reason.is_some());
            }
        }
    }
    let of = |verdict: &str| verdicts.get(verdict).copied().unwrap_or(0);
    assert_eq!(of("rejected"), number(&ran.json, &["candidates", "rejected"]));
    assert_eq!(of("accepted") + of("doubted"), number(&ran.json, &["candidates", "accepted"]));
    let chosen = ran.json["selected"].as_object().unwrap().values().filter_map(serde_json::Value::as_u64);
    assert_eq!(selected, chosen.sum::<u64>());
    assert!(reasons > 500, "{reasons}");
    let roads: Vec<(i64, SceneUpdate)> = decode(&recorded, "/scene_updates/road", Interface::V0_53);
    assert!(roads.len() >= 2 && roads.iter().all(|(_, road)| road.entities[0].lines.len() >= 2));
}

#[test]
fn a_replay_draws_only_when_asked_and_draws_the_same_then() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let made = run(&["demo", "--output", &path("demo"), "--seed", "2"]);
    assert_eq!(made.exit_code, 0, "{}", made.stderr);
    // What the node published is no input of a node, so this replay has no cycles; it is the flag that is looked at.
    let refused = run(&["replay", &path("demo/demo.mcap"), "--markers"]);
    assert_eq!(refused.exit_code, 2, "markers without a file to draw into: {}", refused.stderr);
    let again = run(&["demo", "--output", &path("again"), "--seed", "2"]);
    assert_eq!(again.exit_code, 0, "{}", again.stderr);
    let [first, second] =
        ["demo/demo.mcap", "again/demo.mcap"].map(|name| std::fs::read(path(name)).unwrap());
    assert!(first == second, "the same run draws the same");
}

/// Every topic that a text names, in the order of the text.
fn topics_named(layout: &serde_json::Value, found: &mut BTreeSet<String>) {
    match layout {
        serde_json::Value::Object(entries) => entries.iter().for_each(|(key, value)| {
            found.extend(key.starts_with('/').then(|| key.clone()));
            topics_named(value, found);
        }),
        serde_json::Value::Array(items) => items.iter().for_each(|item| topics_named(item, found)),
        serde_json::Value::String(text) if text.starts_with('/') => {
            found.insert(text.trim_end_matches(".data").to_owned());
        }
        _ => {}
    }
}

#[test]
fn the_foxglove_layout_shows_topics_that_the_demo_writes() {
    let folder = tempfile::tempdir().unwrap();
    let ran = run(&["demo", "--output", folder.path().to_str().unwrap()]);
    assert_eq!(ran.exit_code, 0, "{}", ran.stderr);
    let recorded = read(&folder.path().join("demo.mcap"));
    let written: BTreeSet<&str> = recorded.iter().map(|(topic, ..)| topic.as_str()).collect();
    let layout = serde_json::from_str(include_str!("../docs/foxglove-layout.json")).unwrap();
    let mut named = BTreeSet::new();
    topics_named(&layout, &mut named);
    assert!(named.len() > 10, "{named:?}");
    for topic in &named {
        assert!(written.contains(topic.as_str()), "{topic} is not in the demo's recording");
    }
    for topic in
        written.iter().filter(|topic| topic.contains("/markers/") || topic.contains("/scene_updates/"))
    {
        assert!(named.contains(*topic), "{topic} is not in the layout");
    }
}
