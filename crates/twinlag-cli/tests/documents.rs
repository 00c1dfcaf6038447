//! The sessions shown in the README and in the guide, run as a reader would run them.

#[test]
fn documents_show_what_the_program_prints() {
    trycmd::TestCases::new().case("../../README.md").case("../../docs/src/guide.md");
}
