//! What an error of a store means.

use std::error::Error as _;

use object_store::Error;

/// What the client says before the status of an answer, as it has no other way to say it.
const STATUS: &str = "status code: ";

/// Whether a request would fail the same way at the next try.
pub(crate) fn is_final(error: &Error) -> bool {
    match error {
        // What the object is has been seen to when this is asked.
        Error::Precondition { .. } | Error::AlreadyExists { .. } => false,
        // Timeouts and too many requests pass.
        Error::Generic { .. } => {
            answer(error).is_some_and(|(status, _)| status / 100 == 4 && ![408, 429].contains(&status))
        }
        _ => true,
    }
}

/// Why a request failed: what the store has answered, or what first kept it from answering.
pub(crate) fn reason(error: &Error) -> String {
    answer(error).map_or_else(|| first_cause(error), |(_, text)| text)
}

/// The first cause of an error.
fn first_cause(error: &Error) -> String {
    let causes = std::iter::successors(error.source(), |cause: &&(dyn std::error::Error + 'static)| (*cause).source());
    causes.last().map_or_else(|| error.to_string(), ToString::to_string)
}

/// Status and text of the answer that an error is made of; `None` if there was no answer.
fn answer(error: &Error) -> Option<(u16, String)> {
    let said = first_cause(error);
    let (_, answer) = said.split_once(STATUS)?;
    let status = answer.split([' ', ':']).next()?.parse().ok()?;
    let (head, body) = answer.split_once(": ").unwrap_or((answer, ""));
    let code = body.split_once("<Code>").and_then(|(_, rest)| Some(rest.split_once("</Code>")?.0));
    Some((status, code.map_or_else(|| head.to_owned(), |code| format!("{head}, {code}"))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answered(text: &str) -> Error {
        Error::Generic { store: "S3", source: text.into() }
    }

    /// Texts as the client has them.
    #[test]
    fn an_answer_says_whether_to_ask_again() {
        let no_bucket = answered(
            "Server returned non-2xx status code: 404 Not Found: <?xml version=\"1.0\"?><Error><Code>NoSuchBucket</Code></Error>",
        );
        assert!(is_final(&no_bucket));
        assert_eq!(reason(&no_bucket), "404 Not Found, NoSuchBucket");
        let slow_down = answered("Server returned non-2xx status code: 503 Service Unavailable: ");
        assert!(!is_final(&slow_down));
        assert_eq!(reason(&slow_down), "503 Service Unavailable");
        assert!(!is_final(&answered("Server returned non-2xx status code: 429 Too Many Requests: ")));
        let refused = answered("Connection refused (os error 111)");
        assert!(!is_final(&refused));
        assert_eq!(reason(&refused), "Connection refused (os error 111)");
        assert!(is_final(&Error::NotSupported { source: "".into() }));
    }
}
