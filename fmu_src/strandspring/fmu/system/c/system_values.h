/* The values of one system; the only source that differs from FMU to FMU. Here they are missing. */
.guid = "",
