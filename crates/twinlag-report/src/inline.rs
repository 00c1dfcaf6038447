//! Pictures as parts of a page: their `id`s are made the picture's own.

/// A picture as a part of the page: what comes before `<svg` left out, `id`s and references to them
/// its own, named by its caption. The name space is left out as well: within a page it is known.
pub(crate) fn inlined(svg: &str, figure: usize) -> String {
    let Some(start) = svg.find("<svg") else { return String::new() };
    let mut out = String::with_capacity(svg.len() + 200);
    let mut rest = svg[start..].trim_end();
    // Tag by tag, so that text that looks like an attribute stays as it is.
    while let Some(open) = rest.find('<') {
        let (text, tag) = rest.split_at(open);
        out.push_str(text);
        let end = tag_end(tag);
        let mut owned = tag[..end].to_owned();
        for (name_space, without) in
            [(" xmlns=\"http://www.w3.org/2000/svg\"", ""), (" xmlns:xlink=\"http://www.w3.org/1999/xlink\"", "")]
        {
            owned = owned.replace(name_space, without);
        }
        for reference in [" id=\"", " id='", "url(#", "url('#", "url(\"#", "href=\"#", "href='#"] {
            owned = owned.replace(reference, &format!("{reference}f{figure}-"));
        }
        out.push_str(&owned);
        rest = &tag[end..];
    }
    out.push_str(rest);
    out.replacen("<svg", &format!("<svg role=\"img\" aria-labelledby=\"figure-{figure}\""), 1)
}

/// Where a tag or a comment ends; a `>` between quotes does not end it.
pub(crate) fn tag_end(tag: &str) -> usize {
    if tag.starts_with("<!--") {
        return tag.find("-->").map_or(tag.len(), |k| k + 3);
    }
    let mut quote = None;
    for (k, c) in tag.char_indices() {
        match (quote, c) {
            (None, '>') => return k + 1,
            (None, '"' | '\'') => quote = Some(c),
            (Some(q), _) if q == c => quote = None,
            _ => {}
        }
    }
    tag.len()
}
