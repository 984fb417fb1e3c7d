#include "fmi2_log.h"

static void write_message(const Log *log, FmuStatus status, const char *category, const char *text)
{
    /* The logger takes a format, which text that holds a value of the host must not be. */
    ((fmi2CallbackLogger)log->logger)(log->environment, log->instance_name, status, category, "%s", text);
}

Log fmi2_log(fmi2String name, const fmi2CallbackFunctions *functions)
{
    int named = name != NULL && name[0] != '\0';
    return (Log){
        .write = functions->logger == NULL ? NULL : write_message,
        .logger = (void (*)(void))functions->logger,
        .environment = functions->componentEnvironment,
        .instance_name = named ? name : "unnamed",
        .categories = LOG_ALL,
    };
}
