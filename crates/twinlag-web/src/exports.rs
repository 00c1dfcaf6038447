//! What the page's worker calls.

use std::ops::ControlFlow;

use wasm_bindgen::JsError;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::session::{Session, SessionError};

#[wasm_bindgen]
extern "C" {
    /// A function of the worker, which passes it on to the page.
    #[wasm_bindgen(js_name = sayProgress)]
    fn say_progress(task: &str, done: usize, total: usize);
}

/// A stopped work ends with the worker: nothing asks it to stop.
fn watch(task: &str, done: usize, total: usize) -> ControlFlow<()> {
    say_progress(task, done, total);
    ControlFlow::Continue(())
}

fn thrown(error: SessionError) -> JsError {
    JsError::new(&error.to_string())
}

/// The session of a page, each method as of [`Session`].
#[wasm_bindgen]
#[derive(Debug, Default)]
pub struct Page {
    session: Session,
}

#[wasm_bindgen]
impl Page {
    /// A session without a record.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// [`Session::example`].
    pub fn example() -> Result<String, JsError> {
        Session::example().map_err(thrown)
    }

    /// [`Session::groups`].
    pub fn groups(name: &str, bytes: Vec<u8>) -> Result<String, JsError> {
        Session::groups(name, bytes).map_err(thrown)
    }

    /// [`Session::add`].
    pub fn add(
        &mut self,
        name: &str,
        bytes: Vec<u8>,
        selection: &str,
        group: Option<String>,
        join: bool,
    ) -> Result<String, JsError> {
        self.session.add(name, bytes, selection, group, join).map_err(thrown)
    }

    /// [`Session::diagnose`].
    pub fn diagnose(&mut self, options: &str) -> Result<String, JsError> {
        self.session.diagnose(options, &watch).map_err(thrown)
    }

    /// [`Session::compensate`].
    pub fn compensate(&mut self, model: &str) -> Result<String, JsError> {
        self.session.compensate(model, &watch).map_err(thrown)
    }

    /// [`Session::report`].
    pub fn report(&self, made_at: &str) -> Result<String, JsError> {
        self.session.report(made_at).map_err(thrown)
    }

    /// [`Session::gas_report`].
    #[wasm_bindgen(js_name = gasReport)]
    pub fn gas_report(&self, made_at: &str) -> Result<String, JsError> {
        self.session.gas_report(made_at).map_err(thrown)
    }

    /// [`Session::gas_csv`].
    #[wasm_bindgen(js_name = gasCsv)]
    pub fn gas_csv(&self, bytes: Vec<u8>) -> Result<Option<String>, JsError> {
        self.session.gas_csv(bytes).map_err(thrown)
    }

    /// [`Session::model`].
    pub fn model(&self) -> Result<String, JsError> {
        self.session.model().map_err(thrown)
    }
}
