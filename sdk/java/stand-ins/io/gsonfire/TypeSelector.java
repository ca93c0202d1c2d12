package io.gsonfire;

/** Imported by the client, which has no use for it: the document has no unions. */
public interface TypeSelector<T> {
    Class<? extends T> getClassForElement(com.google.gson.JsonElement element);
}
