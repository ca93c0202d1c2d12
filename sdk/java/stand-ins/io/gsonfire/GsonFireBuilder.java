package io.gsonfire;

import com.google.gson.GsonBuilder;

/** Stands in for gson-fire, of which the client calls nothing but this: without hooks it is a builder of
 * Gson. */
public class GsonFireBuilder {
    public GsonBuilder createGsonBuilder() {
        return new GsonBuilder();
    }
}
