//! What a file holds, and what is made of it.
//!
//! ```text
//! cargo run --release -p twinlag-files --features formats --example contents -- FILE [GROUP]
//! ```

use std::error::Error;
use std::time::Instant;

use twinlag_files::{Choice, contents, read};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("expected the name of a file")?;
    let held = contents(&file)?;
    println!("{} ({})", held.format, held.version);
    held.groups.iter().for_each(|group| println!("  {group}"));
    let start = Instant::now();
    let table = read(&file, &Choice { group: arguments.next(), ..Choice::default() })?;
    println!("{} columns of {} rows in {:.2} s", table.columns().len(), table.rows(), start.elapsed().as_secs_f64());
    table.notes().iter().for_each(|note| println!("  {note}"));
    Ok(())
}
