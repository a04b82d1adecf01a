use super::*;

#[test]
fn the_page_loads_nothing_from_elsewhere() {
    let page = DOCUMENT.write("t", &0).unwrap();
    for loads in ["src=", "href=", "@import", "url(", "fetch(", "XMLHttpRequest", "import("] {
        assert!(!page.contains(loads), "{loads}");
    }
}

#[test]
fn strings_are_numbered_in_order_of_appearance() {
    let mut strings = Strings::default();
    assert_eq!(["a", "b", "a"].map(|text| strings.number(text)), [0, 1, 0]);
    assert_eq!(strings.all, ["a", "b"]);
}
