//! An S3 server on this machine some of whose requests fail: `faulty-s3 FOLDER EVERY`.
//!
//! Buckets are folders in FOLDER, KEY and SECRET its credentials. Of EVERY requests one fails, each time in another way: it is refused
//! with 503; it is carried out, and the connection is closed before the answer; or the answer is cut off in the middle. With EVERY 0 none
//! does. The first line of standard output says where it listens, and it ends when standard input does.

use std::io::Read as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::{Context as _, Result, anyhow};
use futures_util::stream;
use http::{Response, StatusCode};
use http_body_util::combinators::BoxBody;
use http_body_util::{BodyExt as _, Full, StreamBody};
use hyper::body::{Bytes, Frame, Incoming};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::TokioIo;
use s3s::auth::SimpleAuth;
use s3s::service::{S3Service, S3ServiceBuilder};
use s3s_fs::FileSystem;
use tokio::net::TcpListener;

type Body = BoxBody<Bytes, anyhow::Error>;

/// How a request fails.
#[derive(Clone, Copy, Debug)]
enum Fault {
    Refused,
    AnswerLost,
    AnswerCut,
}

impl Fault {
    /// The fault of a request, by its number from 1.
    fn of(number: u64, every: u64) -> Option<Self> {
        let faults = [Self::Refused, Self::AnswerLost, Self::AnswerCut];
        let is_faulty = every > 0 && number % every == 0;
        is_faulty.then(|| faults[(number / every % faults.len() as u64) as usize])
    }
}

#[tokio::main]
async fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, folder, every] = &arguments[..] else { return Err(anyhow!("expected FOLDER and EVERY")) };
    let every: u64 = every.parse().with_context(|| format!("EVERY {every}: expected a number"))?;
    let files = FileSystem::new(folder).map_err(|error| anyhow!("{folder}: {error:?}"))?;
    let mut builder = S3ServiceBuilder::new(files);
    builder.set_auth(SimpleAuth::from_single("KEY", "SECRET"));
    let service = builder.build();
    std::thread::spawn(|| {
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        std::process::exit(0);
    });

    let listener = TcpListener::bind("127.0.0.1:0").await?;
    println!("http://{}", listener.local_addr()?);
    let asked = Arc::new(AtomicU64::new(0));
    loop {
        let (socket, _) = listener.accept().await?;
        let (service, asked) = (service.clone(), asked.clone());
        let answer = service_fn(move |request| {
            let number = asked.fetch_add(1, Ordering::Relaxed) + 1;
            answer(service.clone(), request, Fault::of(number, every))
        });
        tokio::spawn(async move {
            // A connection that is closed in the middle is what was asked for.
            let _ = http1::Builder::new().serve_connection(TokioIo::new(socket), answer).await;
        });
    }
}

/// The answer of the service, or none, or half of it.
async fn answer(service: S3Service, request: http::Request<Incoming>, fault: Option<Fault>) -> Result<Response<Body>> {
    if let Some(Fault::Refused) = fault {
        // Read whole, as a server does that is behind a balancer.
        request.into_body().collect().await?;
        let body = Full::new(Bytes::new()).map_err(|never| match never {}).boxed();
        return Ok(Response::builder().status(StatusCode::SERVICE_UNAVAILABLE).body(body)?);
    }
    let answer = hyper::service::Service::call(&service, request).await.map_err(|error| anyhow!("{error:?}"))?;
    let (head, body) = answer.into_parts();
    let whole = body.collect().await.map_err(|error| anyhow!("{error}"))?.to_bytes();
    match fault {
        Some(Fault::AnswerLost) => Err(anyhow!("the answer is lost")),
        Some(Fault::AnswerCut) if whole.len() > 1 => {
            let half = whole.slice(..whole.len() / 2);
            let frames = [Ok(Frame::data(half)), Err(anyhow!("the answer is cut off"))];
            Ok(Response::from_parts(head, StreamBody::new(stream::iter(frames)).boxed()))
        }
        _ => Ok(Response::from_parts(head, Full::new(whole).map_err(|never| match never {}).boxed())),
    }
}
