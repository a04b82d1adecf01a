use super::*;

#[test]
fn slots_are_filled_once() {
    let page = fill(PAGE, &[("TITLE", "{{DATA}}"), ("DATA", "1"), ("STYLE", ""), ("VIEWER", "")]);
    assert!(page.contains("<title>{{DATA}}</title>"), "what fills a slot is not searched for slots");
    assert!(!page.contains("{{TITLE}}"));
    assert!(page.contains(r#"id="data">1</script>"#));
}

#[test]
fn the_page_loads_nothing_from_elsewhere() {
    let page = fill(PAGE, &[("TITLE", "t"), ("DATA", "{}"), ("STYLE", STYLE), ("VIEWER", VIEWER)]);
    for loads in ["src=", "href=", "@import", "url(", "fetch(", "XMLHttpRequest", "import("] {
        assert!(!page.contains(loads), "{loads}");
    }
}

#[test]
fn text_cannot_become_markup() {
    assert_eq!(escaped("<b>&"), "&lt;b&gt;&amp;");
}

#[test]
fn strings_are_numbered_in_order_of_appearance() {
    let mut strings = Strings::default();
    assert_eq!(["a", "b", "a"].map(|text| strings.number(text)), [0, 1, 0]);
    assert_eq!(strings.all, ["a", "b"]);
}
