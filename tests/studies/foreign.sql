CREATE TRIGGER t AFTER INSERT ON row BEGIN DELETE FROM row; END
CREATE VIEW v AS SELECT randomblob(1000000000)
CREATE INDEX i ON row (length(content))
ALTER TABLE row ADD COLUMN more AS (abs(key))
DROP TABLE row
DELETE FROM job
UPDATE job SET manifest = zeroblob(67108865)
PRAGMA application_id = 7
PRAGMA user_version = 7
