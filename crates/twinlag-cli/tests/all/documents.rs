//! The sessions shown in the README and in the chapters of the book, run as a reader would run them.

#[test]
fn documents_show_what_the_program_prints() {
    trycmd::TestCases::new()
        .case("../../README.md")
        .case("../../docs/src/tutorial.md")
        .case("../../docs/src/guide.md")
        .case("../../docs/src/trades.md")
        .case("../../docs/src/batch.md")
        .case("../../docs/src/reference.md")
        .case("../../docs/src/closed-loop.md");
}
