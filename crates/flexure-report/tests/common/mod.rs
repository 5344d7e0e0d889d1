//! Looking into a page: its data, and what a reader sees.

use serde_json::Value;

/// The page's embedded data.
pub fn data(html: &str) -> Value {
    let (_, rest) = html
        .split_once(r#"<script type="application/json" id="page-data">"#)
        .expect("the data's start");
    let (json, _) = rest.split_once("</script>").expect("the data's end");
    serde_json::from_str(json).expect("valid JSON")
}

/// The page without scripts, styles and data: what a reader sees.
pub fn page_text(html: &str) -> String {
    let mut page_text = String::new();
    let mut rest = html;
    while let Some(start) = ["<script", "<style"].iter().filter_map(|tag| rest.find(tag)).min() {
        page_text.push_str(&rest[..start]);
        let end = if rest[start..].starts_with("<script") {
            "</script>"
        } else {
            "</style>"
        };
        rest = rest[start..].split_once(end).expect("the end tag").1;
    }
    page_text + rest
}
