//! The OpenAPI document of the API, from the table of operations and the types of crate `api`, and the page that shows it.
//!
//! The document is a snapshot in `docs/openapi.json`, served at `/api/v1/openapi.json`, printed by `gs-server openapi`.

mod alerts;
mod forwards;
mod operation;
mod people;
mod table;

use std::sync::LazyLock;

use api::ProblemKind;
use axum::http::HeaderMap;
use axum::response::Response;
use utoipa::openapi::extensions::ExtensionsBuilder;
use utoipa::openapi::path::{ParameterBuilder, ParameterIn, Paths};
use utoipa::openapi::schema::{ComponentsBuilder, ObjectBuilder, Schema, Type};
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityScheme};
use utoipa::openapi::tag::TagBuilder;
use utoipa::openapi::{InfoBuilder, License, OpenApi, OpenApiBuilder, RefOr, Required};
use utoipa::{PartialSchema as _, ToSchema as _};

use super::conditional;
use super::page;

#[cfg(test)]
pub(super) use table::table;

const ABOUT: &str = "Ground station and mission control. Whoever asks shows a token or a session; while a server is open for \
    reading, looking needs neither. Every write needs an idempotency key. Times are RFC 3339 in UTC; unknown is null, never \
    0; units stand in the names. Answers may grow fields: ignore those you do not know. Every error is a Problem with a \
    stable type.";

const TAGS: [(&str, &str); 7] = [
    ("server", "The program itself"),
    ("station", "How the station is, and what an operator switches"),
    ("archive", "What was heard and what happened"),
    ("uplink", "Telecommands and images"),
    ("sky", "Elements, passes, where the satellites are"),
    ("plans", "Plans, which pass each gets, what became of it"),
    ("people", "Who may come in, and what needs a second person"),
];

/// The document.
#[must_use]
pub fn document() -> OpenApi {
    let mut paths = Paths::new();
    let mut components = ComponentsBuilder::new();
    for row in table::table() {
        let (path, method) = (row.path, row.http_method());
        let (operation, schemas) = row.build();
        paths.add_path_operation(path, vec![method], operation);
        components = components.schemas_from_iter(schemas);
    }
    components = components
        .schema("Problem", api::Problem::schema())
        .security_scheme("token", SecurityScheme::Http(token()))
        .parameter("IdempotencyKey", RefOr::T(idempotency_key()));
    let problems: Vec<serde_json::Value> = ProblemKind::ALL
        .iter()
        .map(|kind| serde_json::json!({"type": kind.urn(), "status": kind.status(), "title": kind.title()}))
        .collect();
    let mut schemas = Vec::new();
    api::Problem::schemas(&mut schemas);
    let components = components.schemas_from_iter(schemas).build();
    let mut license = License::new("MIT OR Apache-2.0");
    license.identifier = Some("MIT OR Apache-2.0".to_owned());
    let info = InfoBuilder::new()
        .title("PixelSat Ground")
        .version(format!("v{}", api::API_VERSION))
        .description(Some(ABOUT))
        .license(Some(license));
    let tags = TAGS.map(|(name, what)| TagBuilder::new().name(name).description(Some(what)).build());
    let mut document = OpenApiBuilder::new()
        .info(info.build())
        .paths(paths)
        .components(Some(components))
        .tags(Some(tags))
        .build();
    document.extensions = Some(ExtensionsBuilder::new().add("x-problem-types", problems).build());
    document
}

fn token() -> utoipa::openapi::security::Http {
    let description = "The token of the server's token file; see docs/api.md.";
    HttpBuilder::new().scheme(HttpAuthScheme::Bearer).description(Some(description)).build()
}

fn idempotency_key() -> utoipa::openapi::path::Parameter {
    let text = ObjectBuilder::new()
        .schema_type(Type::String)
        .min_length(Some(1))
        .max_length(Some(128))
        .pattern(Some("^[!-~]+$"));
    ParameterBuilder::new()
        .name("Idempotency-Key")
        .parameter_in(ParameterIn::Header)
        .required(Required::True)
        .description(Some(
            "New for each intent, the same when it is asked again: then nothing happens twice, and the answer is the first.",
        ))
        .schema(Some(Schema::Object(text.build())))
        .build()
}

/// The document as text, as it is served and stored: two spaces, and a new line at its end.
#[must_use]
pub fn text() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let mut text = serde_json::to_string_pretty(&document()).unwrap_or_default();
        text.push('\n');
        text
    });
    &TEXT
}

/// `GET /api/v1/openapi.json`.
pub(super) async fn serve(headers: HeaderMap) -> Response {
    conditional::answer("application/json", text(), &headers)
}

/// `GET /api/docs`: the document for people.
pub(super) async fn docs(headers: HeaderMap) -> Response {
    page::answer("text/html; charset=utf-8", include_str!("../page/docs.html"), &headers)
}
