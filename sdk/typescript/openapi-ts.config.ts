export default {
    input: "../../openapi/openapi.json",
    output: {
        path: "generated",
        module: { extension: ".ts" }, // so that Node.js runs the client without a build
    },
    plugins: [
        "@hey-api/client-fetch",
        "@hey-api/sdk",
        { name: "@hey-api/typescript", enums: { mode: "javascript", case: "SCREAMING_SNAKE_CASE" } },
    ],
};
