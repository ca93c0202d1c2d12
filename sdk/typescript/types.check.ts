// Compares the generated types with the document. Every property, parameter, body and answer must have
// exactly the type that its schema asks for: so there is no `any` or `unknown`, no anonymous object, and null
// where the document allows it and nowhere else. Enumerations must be objects of their values. One answer is
// `unknown`: that of a job, whose type is that of the answer to its request.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import ts from "typescript";

import * as generated from "./generated/types.gen.ts";

interface Schema {
    $ref?: string;
    type?: string | string[];
    items?: Schema;
    enum?: unknown[];
    properties?: Record<string, Schema>;
    required?: string[];
}
interface Body {
    content?: Record<string, { schema: Schema }>;
}
interface Parameter {
    name: string;
    in: string;
    required?: boolean;
    schema: Schema;
}
interface Operation {
    operationId: string;
    parameters?: Parameter[];
    requestBody?: Body;
    responses: Record<string, Body>;
}
interface Document {
    paths: Record<string, Record<string, Operation>>;
    components: { schemas: Record<string, Schema> };
}

const document: Document = JSON.parse(readFileSync("../../openapi/openapi.json", "utf8"));
const aliases = typeAliases("generated/types.gen.ts");
const answersOfAnyType = new Set(["get_job_result"]);

for (const [name, schema] of Object.entries(document.components.schemas)) checkSchema(name, schema);
for (const path of Object.values(document.paths)) Object.values(path).forEach(checkOperation);

function checkSchema(name: string, schema: Schema) {
    if (schema.enum) assert.deepEqual(Object.values(Reflect.get(generated, name)), schema.enum, name);
    else if (schema.properties) checkObject(aliases.get(name), schema, name);
    else assert.equal(aliases.get(name)?.getText(), typeOf(schema), name);
}

function checkOperation({ operationId, parameters = [], requestBody, responses }: Operation) {
    const name = operationId.replace(/(?:^|_)([a-z])/g, (_, letter: string) => letter.toUpperCase());
    const request = members(aliases.get(`${name}Data`));
    if (requestBody) assert.equal(request.get("body")?.type?.getText(), typeOfBody(requestBody), name);
    for (const [place, inPlace] of Map.groupBy(parameters, (parameter) => parameter.in)) {
        checkObject(request.get(place)?.type, objectOf(inPlace), `${name}: ${place}`);
    }
    const answers = new Map([...members(aliases.get(`${name}Errors`)), ...members(aliases.get(`${name}Responses`))]);
    for (const [status, body] of Object.entries(responses).filter(([, { content }]) => content)) {
        const isOfAnyType = status === "200" && answersOfAnyType.has(operationId);
        const expected = isOfAnyType ? "unknown" : typeOfBody(body);
        assert.equal(answers.get(status)?.type?.getText(), expected, `${name}: ${status}`);
    }
}

function objectOf(parameters: Parameter[]): Schema {
    return {
        properties: Object.fromEntries(parameters.map(({ name, schema }) => [name, schema])),
        required: parameters.filter(({ required }) => required).map(({ name }) => name),
    };
}

function checkObject(type: ts.TypeNode | undefined, { properties = {}, required = [] }: Schema, where: string) {
    const declared = [...members(type)].map(([name, member]) => [name, !member.questionToken, member.type?.getText()]);
    const expected = Object.entries(properties).map(([key, schema]) => [key, required.includes(key), typeOf(schema)]);
    assert.deepEqual(declared, expected, where);
}

// The client asks for the first media type, which is JSON where there are several.
function typeOfBody({ content = {} }: Body): string {
    const [body] = Object.values(content);
    assert.ok(body);
    return typeOf(body.schema);
}

function typeOf({ $ref, type, items }: Schema): string {
    if ($ref) return $ref.slice($ref.lastIndexOf("/") + 1);
    if (Array.isArray(type)) return type.map((one) => typeOf(items ? { type: one, items } : { type: one })).join(" | ");
    switch (type) {
        case "array":
            assert.ok(items);
            return `Array<${typeOf(items)}>`;
        case "integer":
            return "number";
        case "boolean":
        case "null":
        case "number":
        case "string":
            return type;
        default:
            throw new Error(`the document should give this schema a name: ${JSON.stringify({ type, items })}`);
    }
}

function typeAliases(path: string): Map<string, ts.TypeNode> {
    const source = ts.createSourceFile(path, readFileSync(path, "utf8"), ts.ScriptTarget.Latest, true);
    return new Map(source.statements.filter(ts.isTypeAliasDeclaration).map(({ name, type }) => [name.text, type]));
}

function members(type: ts.TypeNode | undefined): Map<string, ts.PropertySignature> {
    if (!type || !ts.isTypeLiteralNode(type)) return new Map();
    return new Map(type.members.filter(ts.isPropertySignature).map((member) => [member.name.getText(), member]));
}
