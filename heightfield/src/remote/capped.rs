//! Answers of servers that are no files, cut where they go on and on: the library would keep
//! a page of error without end until memory ends.

use std::future::Future;
use std::pin::Pin;

use futures_util::StreamExt;
use object_store::ClientOptions;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpRequest, HttpResponse, HttpResponseBody, HttpService,
    ReqwestConnector,
};

/// Bytes that are read of such an answer; some hundred of them are shown.
const MOST: usize = 1 << 16;

/// Makes clients that cut answers.
#[derive(Debug, Default)]
pub(super) struct Capped(ReqwestConnector);

#[derive(Debug)]
struct Cutting(HttpClient);

impl HttpConnector for Capped {
    fn connect(&self, options: &ClientOptions) -> object_store::Result<HttpClient> {
        Ok(HttpClient::new(Cutting(self.0.connect(options)?)))
    }
}

impl HttpService for Cutting {
    fn call<'s, 'f>(
        &'s self,
        request: HttpRequest,
    ) -> Pin<Box<dyn Future<Output = Result<HttpResponse, HttpError>> + Send + 'f>>
    where
        's: 'f,
        Self: 'f,
    {
        Box::pin(async move {
            let response = self.0.execute(request).await?;
            Ok(match response.status().is_success() {
                true => response,
                false => cut(response).await,
            })
        })
    }
}

/// The same answer, and no more than [`MOST`] bytes of it. One that breaks off is told by what
/// came.
async fn cut(response: HttpResponse) -> HttpResponse {
    let (parts, body) = response.into_parts();
    let mut stream = body.bytes_stream();
    let mut bytes = Vec::new();
    while bytes.len() < MOST
        && let Some(Ok(part)) = stream.next().await
    {
        bytes.extend_from_slice(part.get(..MOST - bytes.len()).unwrap_or(&part));
    }
    HttpResponse::from_parts(parts, HttpResponseBody::from(bytes))
}
