//! One HTML file with everything in it: style, content, data, and the script that draws the data.
//!
//! Promises: nothing is loaded from elsewhere, and neither a title nor data can become markup.

use serde::Serialize;

const FRAME: &str = include_str!("document/frame.html");

/// What makes one kind of page.
#[derive(Debug, Clone, Copy)]
pub(super) struct Document {
    /// Style sheet.
    pub(super) style: &'static str,
    /// Content; `{{TITLE}}` in it becomes the title.
    pub(super) body: &'static str,
    /// Script, which finds the data as JSON in the element `data`.
    pub(super) viewer: &'static str,
}

impl Document {
    /// The file.
    ///
    /// # Errors
    /// The data have no JSON form.
    pub(super) fn write(&self, title: &str, data: &impl Serialize) -> Result<String, serde_json::Error> {
        // Within a script element only "</" could end the data early.
        let data = serde_json::to_string(data)?.replace("</", "<\\/");
        let title = ("TITLE", &*escaped(title));
        let body = fill(self.body, &[title]);
        let slots = [title, ("STYLE", self.style), ("BODY", &body), ("VIEWER", self.viewer), ("DATA", &data)];
        Ok(fill(FRAME, &slots))
    }
}

/// The template with each `{{NAME}}` replaced. Replacements are not searched again, so data cannot smuggle in a slot.
fn fill(template: &str, slots: &[(&str, &str)]) -> String {
    let mut page = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        page.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        page.push_str(slots.iter().find(|(slot, _)| *slot == name).map_or("", |(_, text)| text));
        rest = after;
    }
    page.push_str(rest);
    page
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Document = Document { style: "", body: "<h1>{{TITLE}}</h1>", viewer: "" };

    #[test]
    fn slots_are_filled_once() {
        let page = PLAIN.write("{{DATA}}", &1).unwrap();
        assert!(page.contains("<title>{{DATA}}</title>"), "what fills a slot is not searched for slots");
        assert!(page.contains("<h1>{{DATA}}</h1>"));
        assert!(!page.contains("{{TITLE}}"));
        assert!(page.contains(r#"id="data">1</script>"#));
    }

    #[test]
    fn text_cannot_become_markup() {
        let page = PLAIN.write("<b>&", &"</script><b>").unwrap();
        assert!(page.contains("<h1>&lt;b&gt;&amp;</h1>") && !page.contains("<b>&"));
        assert!(page.contains(r#"id="data">"<\/script><b>"</script>"#), "{page}");
    }
}
