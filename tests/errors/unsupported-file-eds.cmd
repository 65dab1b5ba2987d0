hal check unsupported-file-eds.eds
