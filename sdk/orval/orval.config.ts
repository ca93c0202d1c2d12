export default {
    gramian: {
        input: "../../openapi/openapi.json",
        output: {
            client: "fetch",
            target: "generated/gramian.ts",
            baseUrl: { runtime: 'process.env.GRAMIAN_URL ?? "http://localhost:8080"' },
            override: {
                // Most bodies and answers have binary formats beside JSON. Without this choice orval takes
                // all of them for binary.
                contentType: { include: ["application/json", "application/problem+json"] },
            },
        },
    },
};
