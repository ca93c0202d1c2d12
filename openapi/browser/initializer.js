// Shows the document of the server that this page comes from.
// Its address is relative, so that it is found behind a proxy that serves everything below a path.
globalThis.SwaggerUIBundle({ url: "../openapi.json", dom_id: "#document", deepLinking: true });
