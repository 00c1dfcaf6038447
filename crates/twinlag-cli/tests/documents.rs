//! The sessions shown in the README, the guide and the chapters on many records and on the closed loop, run as a reader would run them.

#[test]
fn documents_show_what_the_program_prints() {
    trycmd::TestCases::new()
        .case("../../README.md")
        .case("../../docs/src/guide.md")
        .case("../../docs/src/batch.md")
        .case("../../docs/src/closed-loop.md");
}
