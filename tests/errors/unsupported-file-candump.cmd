hal check unsupported-file-candump.log
